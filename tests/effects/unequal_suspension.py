"""Unequal suspension: springs and dampers along two axes fixed in space."""

import numpy as np

from tests.effects.parts import Changes, FiveParts, Run

LAW = {"stiffness_1": 1000.0, "stiffness_2": 1500.0, "damping_1": 0.2, "damping_2": 0.5}
BARE: Changes = {"balls": {"count": 0}, "start": {"ball_angles": [], "speed": 0.0}, "profile": None}
NOTHING = dict.fromkeys(LAW, 1e-9)


class UnequalSuspension(FiveParts):
    name = "unequal_suspension"
    company = "smooth"
    changes = {"effects": {"unequal_suspension": {**LAW, "axis_angle": 0.4}}}
    dissipates = True

    def strength(self, run: Run) -> float:
        """Return the force that the second spring adds, over the unbalance's force."""
        law, out = run.effect("unequal_suspension"), run.trajectory
        across = np.cos(law.axis_angle) * out["y"] - np.sin(law.axis_angle) * out["x"]
        added = abs(law.stiffness_2 - law.stiffness_1) * np.abs(across).max()
        return float(added / (0.098 * 1e-4 * 1e4))

    def direction(self) -> None:
        """Check that the force points straight back along an axis, but not between the axes."""
        first = np.array([np.cos(0.4), np.sin(0.4)])
        second = np.array([-np.sin(0.4), np.cos(0.4)])
        idle = {"unequal_suspension": NOTHING}
        for a, b in ((1.0, 0.0), (0.0, 1.0), (1.0, -2.0)):
            u, v = 1e-3 * (a * first + b * second), 0.1 * (b * first + a * second)
            added = self.adds(idle, BARE, deck=[*u, *v])
            force = -(1.0 * a + 0.02 * b) * first - (1.5 * b + 0.05 * a) * second
            np.testing.assert_allclose(added.deck[2:], force / 0.1, rtol=1e-3)

    def rotation(self) -> None:
        """Check rotation together with the axes; without them the motion differs."""
        super().rotation()
        one, other = self.watch(), self.watch({"start": {"angle": 0.7}})
        balls = one.trajectory.ball_angles - other.trajectory.ball_angles
        assert np.abs(balls).max() > 1e-3

    def alone(self) -> tuple[Changes, ...]:
        return ({"effects": {"unequal_suspension": LAW}},)

    def loss(self, run: Run) -> float:
        out = run.trajectory
        v1 = np.cos(0.4) * out["vx"] + np.sin(0.4) * out["vy"]
        v2 = np.cos(0.4) * out["vy"] - np.sin(0.4) * out["vx"]
        return run.integral(0.2 * v1**2 + 0.5 * v2**2)

    def limit(self) -> None:
        """Check that equal axes approach the effect suspension."""

        def nearly(size: float) -> Changes:
            more = {"stiffness_2": 1000.0 + size, "damping_2": 0.2 + 1e-3 * size}
            return {"effects": {"unequal_suspension": {**LAW, **more}}}

        self.vanishes(nearly, without={})


PARTS = UnequalSuspension()

"""Suspension: the spring pulls back and the damper brakes; without both the deck is free."""

import numpy as np

from tests.effects.parts import NO_LOSSES, Changes, FiveParts, Run, closes


class Suspension(FiveParts):
    name = "suspension"
    company = "thesis"
    dissipates = True

    def strength(self, run: Run) -> float:
        """Return the spring force relative to the unbalance's force; ``loss`` shows the damper."""
        spring = run.effect("suspension").stiffness * run.trajectory.whirl.max()
        return float(spring / (0.098 * 1e-4 * 1e4))

    def direction(self) -> None:
        bare: Changes = {"balls": {"count": 0}, "start": {"ball_angles": [], "speed": 0.0}}
        bare["profile"] = None
        idle = {"suspension": {"stiffness": 0.0, "damping": 0.0}}
        for u, v in (([1e-3, 0.0], [0.0, 0.0]), ([0.0, 0.0], [0.0, 0.1]), ([1e-3, 2e-3], [0.1, 0])):
            added = self.adds(idle, bare, deck=[*u, *v])
            force = -1000.0 * np.array(u) - 0.2 * np.array(v)
            np.testing.assert_allclose(added.deck[2:], force / 0.1, rtol=1e-4, atol=1e-3)

    def power(self) -> None:
        """Check that the damper dissipates and that the spring alone conserves energy."""
        super().power()
        spring = self.watch({"effects": NO_LOSSES["thesis"]})
        closes(spring)
        assert spring.energies[-1].dissipated == 0.0

    def alone(self) -> tuple[Changes, ...]:
        return ({"effects": {"suspension": {"damping": 0.2}}},)

    def loss(self, run: Run) -> float:
        return run.integral(0.2 * (run.trajectory["vx"] ** 2 + run.trajectory["vy"] ** 2))

    def limit(self) -> None:
        self.vanishes(
            lambda size: {
                "effects": {"suspension": {"stiffness": 0.1 * size, "damping": 1e-4 * size}}
            },
            without={"suspension": None},
        )


PARTS = Suspension()

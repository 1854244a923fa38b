"""Contact of balls: they separate or stay together after an impact, and momentum is conserved."""

import numpy as np
import pytest

from ab_sim.model.dynamics.system import JOINED
from tests.effects.parts import Changes, FiveParts, Run, closes, run, scene_of

MEETING: Changes = {
    "start": {"speed": 90.0, "ball_angles": [0.6, -0.6]},
    "effects": {"viscous_drag": {"coefficient": 0.02}},
}
ALONE: Changes = {
    "rotor": {"eccentricity": 0.0, "total_mass": 100.0},
    "start": {"speed": 0.0, "ball_angles": [0.0, 0.5]},
    "profile": None,
    "effects": {"viscous_drag": {"coefficient": 0.0}},
}


def bouncing(restitution: float) -> Changes:
    return {"effects": {"ball_contact": {"restitution_coefficient": restitution}}}


class BallContact(FiveParts):
    name = "ball_contact"
    company = "contact"
    changes = MEETING
    dissipates = True
    least = 0.5
    steps = 600
    rounding = 1e-8
    loss_known = 0.03

    def strength(self, run: Run) -> float:
        """Return the number of events after checking that impacts keep the balls apart."""
        room = 2 * np.arcsin(run.scene.balls.radii[0] / 0.01)
        angles = run.trajectory.ball_angles
        gaps = (angles[:, 0] - angles[:, 1]) % (2 * np.pi)
        assert gaps.min() > room - 1e-9 and 2 * np.pi - gaps.max() > room - 1e-9
        return float(run.drive.events)

    def activity(self) -> None:
        """Check that balls bounce, and that they stay together with a restitution of 0."""
        self.watch(bouncing(0.7))
        seen = self.watch(bouncing(0.0))
        joined = seen.discrete_state[:, :2, JOINED].any(axis=1)
        assert joined.any() and not joined.all()

    def direction(self) -> None:
        """Check that balls part at the restitution times the approach speed and conserve momentum.

        A heavy deck keeps the balls' momentum unchanged.
        """
        for restitution in (0.0, 0.4, 1.0):
            drive = run(scene_of("contact", ALONE, bouncing(restitution)), 1).drive
            kept = drive.snapshot()
            kept.state[drive.layout.rates] = 6.0, 1.0
            drive.restore(kept)
            after = drive.advance(100).ball_rates[-1]
            assert drive.events >= 1
            assert after[1] - after[0] == pytest.approx(restitution * 5.0, abs=1e-3)
            assert after.sum() == pytest.approx(7.0, abs=2e-3)
        self.watch()

    def power(self) -> None:
        """Check that an impact takes (1 - e^2) of the approach's energy, and none if elastic."""
        super().power()
        elastic = self.watch({"effects": {"viscous_drag": {"coefficient": 0.0}}}, bouncing(1.0))
        damped = elastic.integral(
            0.2 * (elastic.trajectory["vx"] ** 2 + elastic.trajectory["vy"] ** 2)
        )
        closes(elastic)
        assert elastic.energies[-1].dissipated == pytest.approx(damped, rel=0.01)

    def loss(self, run: Run) -> float:
        """Return the loss [J] from the jumps of the ball rates, as if the deck did not move."""
        rates = np.vstack([run.states[:1, run.drive.layout.rates], run.trajectory.ball_rates])
        parting = np.diff(rates, axis=1)[:, 0]
        hits = np.flatnonzero(np.abs(np.diff(parting)) > 0.2 * np.abs(parting).max())
        assert hits.size
        lost = 0.0
        for k in hits:
            lost += 0.25 * 1.4e-3 * 1e-4 * (parting[k] ** 2 - parting[k + 1] ** 2)
        return float(lost)

    def limit(self) -> None:
        """Check that small equal elastic balls exchange their motion, as if they passed through."""
        gaps = []
        for radius in (1e-5, 1e-6):
            small: Changes = {"balls": {"radius": radius}, **MEETING}
            through = run(scene_of("thesis", small), self.steps).trajectory
            seen = self.watch(small, bouncing(1.0)).trajectory
            assert np.any(np.diff(through.ball_angles, axis=1) > 0), "they passed"
            one, other = (np.sort(t.ball_angles, axis=1) for t in (seen, through))
            gaps.append(float(np.abs(one - other).max()))
        assert 1e-9 < gaps[0] < 0.1
        assert gaps[1] == pytest.approx(0.1 * gaps[0], rel=0.2)


PARTS = BallContact()

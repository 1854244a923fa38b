"""Hardening suspension: the cubic spring's force grows faster than the displacement."""

import numpy as np

from tests.effects.parts import Changes, FiveParts, Run

HARD = 1e9
IDLE: Changes = {"hardening_suspension": {"cubic_stiffness": 0.0}}
BARE: Changes = {"balls": {"count": 0}, "start": {"ball_angles": [], "speed": 0.0}, "profile": None}


class HardeningSuspension(FiveParts):
    name = "hardening_suspension"
    company = "smooth"
    changes = {"effects": {"hardening_suspension": {"cubic_stiffness": HARD}}}
    dissipates = False

    def strength(self, run: Run) -> float:
        """Return the cubic force relative to that of the linear spring, at the largest whirl."""
        cubic = run.effect("hardening_suspension").cubic_stiffness
        return float(cubic * run.trajectory.whirl.max() ** 2 / 1000.0)

    def direction(self) -> None:
        for u in ([1e-3, 0.0], [0.0, -2e-3], [1e-3, 2e-3]):
            added = self.adds(IDLE, BARE, deck=[*u, 0.0, 0.0])
            force = -HARD * (u[0] ** 2 + u[1] ** 2) * np.array(u)
            np.testing.assert_allclose(added.deck[2:], force / 0.1, rtol=1e-4, atol=1e-3)

    def limit(self) -> None:
        self.vanishes(
            lambda size: {"effects": {"hardening_suspension": {"cubic_stiffness": 1e6 * size}}},
            without={},
        )


PARTS = HardeningSuspension()

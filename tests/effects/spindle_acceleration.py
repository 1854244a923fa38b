"""Spindle acceleration: balls are left behind, and the unbalance is pressed back."""

import numpy as np
import pytest

from tests.effects.parts import NO_LOSSES, Changes, FiveParts, Run, apart, closes, run, scene_of

OPPOSED: Changes = {"start": {"ball_angles": [0.0, np.pi]}}


class SpindleAcceleration(FiveParts):
    name = "spindle_acceleration"
    company = "thesis"
    dissipates = False

    def strength(self, run: Run) -> float:
        """Return the acceleration relative to that of the thesis."""
        return float(np.ptp(run.trajectory["speed"]) / run.time[-1] / 40.0)

    def direction(self) -> None:
        """Check that opposite balls fall behind alike, and that the unbalance is pressed back."""
        added = self.slope(OPPOSED).less(self.slope(OPPOSED, {"profile": None}))
        assert added.deck[3] == pytest.approx(-0.098e-4 * 40.0 / 0.1, rel=0.05)
        assert added.rates == pytest.approx(-40.0 * (0.01 - 0.4e-3) / (1.4 * 0.01), rel=0.02)
        self.watch()

    def power(self) -> None:
        """Check that nothing dissipates, and the work for balls at opposite places."""
        super().power()
        balanced = {"rotor": {"eccentricity": 0.0}}
        seen = self.watch(OPPOSED, balanced, {"effects": NO_LOSSES["thesis"]}, steps=100)
        closes(seen)
        energy = seen.energies[-1]
        assert energy.motor_work == pytest.approx(energy.stored - energy.at_start, rel=1e-10)
        along = 0.01 * (seen.trajectory["speed"][-1] + seen.trajectory.ball_rates[-1, 0])
        spin = (1e-3 * seen.trajectory["speed"] - 0.01 * seen.trajectory.ball_rates[:, 0])[-1]
        kinetic = 2 * (0.5 * 1e-3 * along**2 + 0.5 * 0.4e-3 * spin**2)
        assert energy.stored == pytest.approx(kinetic, rel=1e-9)

    def limit(self) -> None:
        """Check that the model without this effect misses less in a slower run-up."""
        gaps = []
        for slope in (1.0, 0.1):
            slow: Changes = {"profile": {"acceleration": slope, "kind": "start_up"}}
            slow["profile"]["target_speed"] = 400.0
            blind = scene_of("thesis", slow, {"effects": {"spindle_acceleration": None}})
            felt = self.watch(slow, least=0.0).trajectory
            gaps.append(apart(felt, run(blind, self.steps, energy_balance=False).trajectory))
        assert 1e-9 < gaps[0] < 0.3
        assert gaps[1] == pytest.approx(0.1 * gaps[0], rel=0.15)


PARTS = SpindleAcceleration()

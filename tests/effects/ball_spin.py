"""Spin of rolling balls: more inertia along the race, and spin-up by the spindle."""

import numpy as np
import pytest

from tests.effects.parts import FiveParts, Run, apart, run, scene_of

OPPOSED = {"rotor": {"eccentricity": 0.0}, "start": {"ball_angles": [0.0, np.pi]}}


class BallSpin(FiveParts):
    name = "ball_spin"
    company = "thesis"
    dissipates = False
    least = 1e-3

    def strength(self, run: Run) -> float:
        """Return rolling inertia times path acceleration over a ball's centrifugal force."""
        path = 0.01 * np.diff(run.trajectory.ball_rates, axis=0) / run.drive.step
        return float(0.4e-3 * np.abs(path).max() / (1e-3 * 0.01 * 1e4))

    def direction(self) -> None:
        """Check that a run-up leaves a rolling ball behind 24/35 as fast as a sliding one."""
        lag = self.slope(OPPOSED).less(self.slope(OPPOSED, {"profile": None}))
        assert lag.rates == pytest.approx(-40.0 * (0.01 - 0.4e-3) / (1.4 * 0.01), rel=1e-3)
        self.watch()

    def limit(self) -> None:
        """Check that lighter balls spin less under drag; the effect has no parameter."""
        gaps = []
        for mass, step in ((2e-4, 1e-4), (2e-5, 1e-5)):
            light = {"balls": {"mass": mass}, "solver": {"step": step}}
            steps = round(0.1 / step)
            slides = {"balls": {"radius": None}, "effects": {"ball_spin": None}}
            rolling = self.watch(light, least=0.0, steps=steps).trajectory
            gaps.append(apart(rolling, run(scene_of("thesis", light, slides), steps).trajectory))
        assert 1e-9 < gaps[0] < 0.1
        assert gaps[1] == pytest.approx(0.1 * gaps[0], rel=0.2)


PARTS = BallSpin()

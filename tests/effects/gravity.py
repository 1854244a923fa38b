"""Gravity: balls and deck are pulled down, and the suspension holds the deck."""

import numpy as np
import pytest

from tests.effects.parts import Changes, FiveParts, Run

DOWN: Changes = {
    "start": {"speed": 0.0, "ball_angles": [0.0, np.pi]},
    "profile": None,
}
IDLE: Changes = {"gravity": {"tilt": 0.0}}


class Gravity(FiveParts):
    name = "gravity"
    company = "smooth"
    changes = {"effects": {"gravity": {"tilt": 1.2, "direction": 0.7}}}
    dissipates = False

    def strength(self, run: Run) -> float:
        """Return gravity across the shaft relative to a ball's centrifugal acceleration."""
        return float(np.hypot(*run.effect("gravity").gravity()) / (0.01 * 1e4))

    def direction(self) -> None:
        """Check that on edge balls roll down or stay at the bottom, and flat nothing moves."""
        on_edge = {"gravity": {"tilt": np.pi / 2, "direction": -np.pi / 2}}
        added = self.adds(IDLE, DOWN, {"effects": on_edge})
        assert added.rates[0] == pytest.approx(-9.80665 / 0.014, rel=0.03)
        assert added.rates[1] == pytest.approx(9.80665 / 0.014, rel=0.03)
        low = {"start": {"ball_angles": [-np.pi / 2, -np.pi / 2]}, "rotor": {"eccentricity": 0.0}}
        seen = self.watch(DOWN, low, {"effects": on_edge})
        assert seen.trajectory.whirl.max() < 1e-12, "at rest, balls at the bottom"
        assert np.abs(seen.trajectory.ball_angles + np.pi / 2).max() < 1e-12
        flat = self.slope(DOWN, {"effects": {"gravity": {"tilt": 0.0}}})
        assert not flat.angles.any() and not flat.rates.any(), "lying flat, nothing falls"

    def rotation(self) -> None:
        """Check rotation together with the direction of gravity; without it the motion differs."""
        super().rotation()
        one, other = self.watch(), self.watch({"start": {"angle": 0.7}})
        balls = one.trajectory.ball_angles - other.trajectory.ball_angles
        assert np.abs(balls).max() > 1e-3

    def limit(self) -> None:
        self.vanishes(lambda size: {"effects": {"gravity": {"tilt": 1e-3 * size}}}, without={})


PARTS = Gravity()

"""Viscous drag: it brakes the balls on the race."""

import numpy as np
import pytest

from tests.effects.parts import Changes, FiveParts, Run


class ViscousDrag(FiveParts):
    name = "viscous_drag"
    company = "thesis"
    dissipates = True

    def strength(self, run: Run) -> float:
        """Return the largest drag relative to a ball's centrifugal force."""
        drag = run.effect("viscous_drag").coefficient * 0.01 * np.abs(run.trajectory.ball_rates)
        return float(drag.max() / (1e-3 * 0.01 * 1e4))

    def direction(self) -> None:
        opposed: Changes = {
            "rotor": {"eccentricity": 0.0},
            "start": {"ball_angles": [0.0, np.pi]},
            "profile": None,
        }
        idle = {"viscous_drag": {"coefficient": 0.0}}
        for rate in (3.0, -3.0):
            added = self.adds(idle, opposed, rates=[rate, rate])
            assert added.rates == pytest.approx(-1.0 * rate / 1.4e-3, rel=1e-3)

    def alone(self) -> tuple[Changes, ...]:
        return ({"effects": {"viscous_drag": {"coefficient": 1.0}}},)

    def loss(self, run: Run) -> float:
        return run.integral(1.0 * np.sum((0.01 * run.trajectory.ball_rates) ** 2, axis=1))

    def limit(self) -> None:
        self.vanishes(
            lambda size: {"effects": {"viscous_drag": {"coefficient": 1e-5 * size}}},
            without={"viscous_drag": None},
        )


PARTS = ViscousDrag()

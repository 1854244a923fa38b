"""Common parts of both kinds of friction, which differ only in their coefficient."""

from typing import Any

import numpy as np
import pytest

from ab_sim.model.dynamics.system import DIRECTION, LOADED
from tests.effects.parts import Changes, FiveParts, Run

OPPOSED: Changes = {
    "rotor": {"eccentricity": 0.0},
    "start": {"speed": 100.0, "ball_angles": [0.0, np.pi]},
    "profile": None,
}


class FrictionParts(FiveParts):
    company = "friction"
    dissipates = True
    least = 0.5

    def law(self, coefficient: float) -> Changes:
        """Return the changes that give a coefficient of friction."""
        raise NotImplementedError

    def strength(self, run: Run) -> float:
        """Return the fraction of time in which balls slide; 0 unless each ball slides at times."""
        pressed = run.discrete_state[:, :-1, LOADED] == 1
        slides = pressed & (run.discrete_state[:, :-1, DIRECTION] != 0)
        rubs = self.coefficient(run) > 0 and run.drive.events > 0
        return float(slides.mean()) if rubs and slides.any(axis=0).all() else 0.0

    def coefficient(self, run: Run) -> float:
        """Return the friction coefficient f of a run."""
        raise NotImplementedError

    def direction(self) -> None:
        """Check that friction is f N against the motion, and holds balls at rest up to that."""
        idle = self.law(0.0)["effects"]
        for rate in (3.0, -3.0):
            added = self.adds(idle, OPPOSED, self.law(0.05), rates=[rate, rate])
            press = 0.01 * (100.0 + rate) ** 2
            assert added.rates == pytest.approx(-np.sign(rate) * 0.05 * press / 0.014, rel=1e-3)
        on_edge: Changes = {"effects": {"gravity": {"tilt": np.pi / 2}}}
        held = self.slope(OPPOSED, on_edge, self.law(0.12))
        assert held.rates == pytest.approx(0.0), "9.8 m/s^2 against 0.12 times 100 m/s^2"
        slips = self.slope(OPPOSED, on_edge, self.law(0.05))
        assert slips.rates[0] < -100.0 and slips.rates[1] > 100.0

    def activity(self) -> None:
        """Check that balls slide both ways and are held at times."""
        self.watch()
        seen = self.watch(self.law(0.2), {"effects": {"gravity": {"tilt": 1.2}}}, least=0.05)
        stuck = (seen.discrete_state[:, :2, DIRECTION] == 0) & (
            seen.discrete_state[:, :2, LOADED] == 1
        )
        assert stuck.any() and not stuck.all() and seen.drive.steps_with_unresolved_events == 0
        assert np.all(seen.states[:, seen.drive.layout.rates][stuck] == 0.0), "held exactly"

    def loss(self, run: Run) -> float:
        out = run.trajectory
        normal = out["angle"][:, None] + out.ball_angles
        outwards = out["ax"][:, None] * np.cos(normal) + out["ay"][:, None] * np.sin(normal)
        absolute = out["speed"][:, None] + out.ball_rates
        press = np.maximum(1e-3 * (0.01 * absolute**2 - outwards), 0.0)
        rubbed = self.coefficient(run) * press * np.abs(0.01 * out.ball_rates)
        return run.integral(rubbed.sum(axis=1))

    def limit(self) -> None:
        self.vanishes(lambda size: self.law(1e-5 * size), without={}, within=0.15)


def effect(name: str, key: str, value: float) -> dict[str, Any]:
    return {"effects": {name: {key: value}}}

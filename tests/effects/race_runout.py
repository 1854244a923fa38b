"""Runout: on a race that is off the shaft axis, or oval, balls move to its widest place."""

import numpy as np
import pytest

from tests.effects.parts import Changes, FiveParts, Run

QUIET: Changes = {
    "rotor": {"eccentricity": 0.0},
    "start": {"speed": 100.0, "ball_angles": [np.pi / 2, -np.pi / 2]},
    "profile": None,
}
ROUND: Changes = {"race_runout": {"offset_1": 0.0, "offset_2": 0.0, "lobe": 0.0}}


class RaceRunout(FiveParts):
    name = "race_runout"
    company = "smooth"
    changes = {
        "effects": {
            "race_runout": {"offset_1": 3e-4, "offset_2": -2e-4, "lobe": 2e-4, "lobe_angle": 0.3}
        }
    }
    dissipates = False

    def strength(self, run: Run) -> float:
        """Return the change of a ball's distance from the shaft, relative to the eccentricity."""
        law = run.effect("race_runout")
        return float((np.hypot(law.offset_1, law.offset_2) + law.lobe) / 1e-4)

    def direction(self) -> None:
        """Check that balls move outwards: to the offset, or to both ends of an oval."""
        offset = {"race_runout": {"offset_1": 1e-4, "offset_2": 0.0, "lobe": 0.0}}
        added = self.adds(ROUND, QUIET, {"effects": offset})
        pull = 1e-4 * 1e4 / (1.4 * 0.01)
        assert added.rates == pytest.approx([-pull, pull], rel=0.03)
        aside = {"start": {"ball_angles": [np.pi / 4, -3 * np.pi / 4]}}
        lobe = {"offset_1": 0.0, "offset_2": 0.0, "lobe": 1e-5, "lobe_angle": 0.0}
        added = self.adds(ROUND, QUIET, aside, {"effects": {"race_runout": lobe}})
        assert added.rates == pytest.approx(-2e-5 * 1e4 / (1.4 * 0.01), rel=0.03)

    def limit(self) -> None:
        def slightly(size: float) -> Changes:
            few = {"offset_1": 3e-8, "offset_2": -2e-8, "lobe": 2e-8}
            return {"effects": {"race_runout": {key: size * few[key] for key in few}}}

        self.vanishes(slightly, without={})


PARTS = RaceRunout()

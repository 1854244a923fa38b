"""The drive that all of them run: the thesis' start-up with a hold, without friction."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim.accuracy.deviation import Samples, deviation
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.load import changed_scene
from ab_sim.studies.accuracy_cost.collocation import collocate, step_for
from ab_sim.studies.accuracy_cost.reference import Reference, smooth_reference
from ab_sim.studies.accuracy_cost.right_hand_side import RightHandSide
from ab_sim.studies.accuracy_cost.sampling import Sampling

SCENE, CHANGES = "thesis-hold", ["effects.rolling_friction="]
SAMPLING = Sampling(0.005, 1200)
"""All have output every 5 ms, and are compared there."""
VARIATIONS: list[dict[str, Any]] = [{"balls.mass": 1e-3 * (1.0 + 0.01 * i)} for i in range(8)]
"""The runs of a batch."""


def scene(*changes: str) -> Scene:
    """The drive, with further changes."""
    return load_scene(SCENE, [*CHANGES, *changes])


class Case:
    """One run, and what it is compared with."""

    def __init__(self) -> None:
        self.scene = scene()
        self.f = RightHandSide(self.scene, SAMPLING)
        self.reference: Reference = smooth_reference(self.f)

    def error(self, samples: Samples) -> float:
        """The largest in a ball's angle [rad]."""
        return off(samples, self.reference.first, self.scene)


class BatchCase:
    """Eight runs that differ in the balls' mass."""

    def __init__(self) -> None:
        base = scene()
        self.runs = [
            RightHandSide(changed_scene(base, each, "a run of the batch"), SAMPLING)
            for each in VARIATIONS
        ]
        self.references = [
            f.samples(collocate(f, min(step_for(f), SAMPLING.period))) for f in self.runs
        ]

    def error(self, runs: Sequence[Samples]) -> float:
        """The largest in a ball's angle in any of them [rad]."""
        each = zip(runs, self.references, self.runs, strict=True)
        return max(off(samples, reference, f.scene) for samples, reference, f in each)


def off(samples: Samples, reference: Samples, of: Scene) -> float:
    """How far a run is from its reference in ball angle, at most [rad]; NaN if it is not finite."""
    if not np.isfinite(samples.angles).all():
        return float("nan")
    return deviation(samples, reference, of.whirl_unit[0]).angle

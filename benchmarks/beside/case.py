"""Drive that all methods run: the thesis' start-up with a hold, without friction.

Further cases change this drive; the peers' own equations have its effects only.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.accuracy_cost.problem import RightHandSide, SampleTimes
from ab_sim.analysis.accuracy_cost.reference import Reference, collocate, smooth_reference, step_for
from ab_sim.drive.accuracy.trials import Samples, deviation
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.load import changed_scene

SCENE, CHANGES = "thesis-hold", ["effects.rolling_friction="]
SAMPLING = SampleTimes(0.005, 1200)
"""Output times of all methods, at which they are compared: every 5 ms."""
CONDITIONS = {
    "scene": SCENE,
    "changes": CHANGES,
    "duration": SAMPLING.end,
    "period": SAMPLING.period,
}
"""Conditions for a report."""
VARIATIONS: list[dict[str, Any]] = [{"balls.mass": 1e-3 * (1.0 + 0.01 * i)} for i in range(8)]
"""Runs of a batch."""


class EqualBall(NamedTuple):
    """Parameters of equal balls, with the symbols of docs/equations.md."""

    m: float
    a: float
    mu: float
    lever: float
    """Lever (m R - (I/a^2) a)/mu [m]."""
    drag: float
    """Drag coefficient c_b [N s/m]."""


class Case:
    """One run of a drive, with its reference.

    Parameters
    ----------
    changes
        Changes of the drive.
    """

    def __init__(self, changes: Sequence[str] = ()) -> None:
        self.changes = (*CHANGES, *changes)
        self.scene = self.with_solver()
        self.f = RightHandSide(self.scene, SAMPLING)
        self.reference: Reference = smooth_reference(self.f)

    def with_solver(self, *solver: str) -> Scene:
        """Return the drive with solver settings."""
        return load_scene(SCENE, [*self.changes, *solver])

    def error(self, samples: Samples) -> float:
        """Return the largest error in a ball's angle [rad]."""
        return off(samples, self.reference.first, self.scene)


class BatchCase:
    """Eight runs that differ in the balls' mass."""

    def __init__(self) -> None:
        scenes = [changed_scene(self.with_solver(), each, str(each)) for each in VARIATIONS]
        self.runs = [RightHandSide(scene, SAMPLING) for scene in scenes]
        self.references = [
            f.samples(collocate(f, min(step_for(f), SAMPLING.period))) for f in self.runs
        ]

    def with_solver(self, *solver: str) -> Scene:
        """Return the common scene with solver settings."""
        return load_scene(SCENE, [*CHANGES, *solver])

    def error(self, runs: Sequence[Samples]) -> float:
        """Return the largest error in a ball's angle in any run [rad]."""
        each = zip(runs, self.references, self.runs, strict=True)
        return max(off(samples, reference, f.scene) for samples, reference, f in each)


def equal_balls(scene: Scene) -> EqualBall:
    """Return the parameters for the peers' own equations, which require equal balls."""
    m, a = scene.balls.masses[0], scene.balls.radii[0]
    effects = tuple(scene.effects.values())
    inertia, drag = (
        over_effects(effects, of_ball, 0.0, Ball(m, a)) for of_ball in ("ball_inertia", "ball_drag")
    )
    return EqualBall(m, a, m + inertia, (m * scene.race.radius - inertia * a) / (m + inertia), drag)


def off(samples: Samples, reference: Samples, of: Scene) -> float:
    """Return the largest difference from the reference in ball angle [rad]; NaN if not finite."""
    if not np.isfinite(samples.angles).all():
        return float("nan")
    return deviation(samples, reference, of.whirl_unit[0]).angle

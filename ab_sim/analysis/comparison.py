"""The same run without its balls, and without its variable-speed period: what they do."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.merits import Merits
from ab_sim.analysis.offline import OfflineRun, run_scene
from ab_sim.drive import Drive
from ab_sim.errors import AbSimError
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.trajectory import Trajectory


class Compared(NamedTuple):
    """A run beside the one in question."""

    merits: Merits
    time: np.ndarray
    """s, shape (samples,)."""
    whirl: np.ndarray
    """m, shape (samples,)."""
    speed: np.ndarray
    """rad/s, shape (samples,)."""


class Comparison(NamedTuple):
    """What a run is compared with; each is None where the scene has nothing to leave out."""

    without_period: Compared | str | None
    """Without the variable-speed period; a text says why it could not run."""
    without_balls: Compared | str | None
    """Without the balls: they and their mass are taken out of the drive, so that what moves on the
    suspension is M - sum m_i, and the unbalance M0 e remains."""

    def by_name(self) -> dict[str, Compared | str]:
        """What there is, under names for people."""
        named = {
            "without variable-speed period": self.without_period,
            "without balls": self.without_balls,
        }
        return {name: run for name, run in named.items() if run is not None}

    def relative_whirl(self, merits: Merits) -> float | None:
        """A run's final whirl in that of the run without balls; None if that is not to be had."""
        alone = self.without_balls
        if not isinstance(alone, Compared) or alone.merits.final_whirl == 0:
            return None
        return merits.final_whirl / alone.merits.final_whirl

    def report(self, merits: Merits, eccentricity: float) -> dict[str, Any]:
        """As JSON-able values, to be added to those of the run that has ``merits``."""
        runs: dict[str, Any] = {
            "without_variable_speed_period": self.without_period,
            "without_balls": self.without_balls,
        }
        for name, run in runs.items():
            if isinstance(run, Compared):
                runs[name] = {
                    **run.merits.report(eccentricity),
                    "final_whirl_relative_to_no_balls": self.relative_whirl(run.merits),
                }
            elif run is not None:
                runs[name] = {"failure": run}
        return {"final_whirl_relative_to_no_balls": self.relative_whirl(merits), **runs}


def compare(
    run: OfflineRun, progress: Callable[[Drive, Trajectory], None] | None = None
) -> Comparison:
    """Run again without the variable-speed period, and without balls; all else is the same.

    Args:
        run: what to compare with; the others last as long, with its stepper and step.
        progress: as in ``run_scene``.
    """
    scene = run.scene
    same: dict[str, Any] = {
        "solver.stepper": run.stepper,
        "duration": float(run.trajectory["time"][-1]),
    }

    def beside(what: str, changes: dict[str, Any]) -> Compared | str:
        try:
            changed = changed_scene(
                scene, {**same, "name": f"{scene.name}, {what}", **changes}, what
            )
            other = run_scene(changed, progress=progress)
        except AbSimError as error:
            return str(error)
        path = other.trajectory
        return Compared(other.merits, path["time"].copy(), path.whirl, path["speed"].copy())

    period = balls = None
    if run.variable_speed_period is not None:
        period = beside("without variable-speed period", {"profile.variable_speed_period": None})
    if scene.balls.count:
        balls = beside("without balls", _balls_taken_out(scene))
    return Comparison(period, balls)


def _balls_taken_out(scene: Scene) -> dict[str, Any]:
    return {
        "balls": {"count": 0},
        "start.ball_angles": None,
        "rotor": {
            "mass": scene.total_mass - scene.balls.total_mass,
            "eccentricity": scene.rotor.eccentricity,
            "eccentric_mass": scene.eccentric_mass,
        },
    }

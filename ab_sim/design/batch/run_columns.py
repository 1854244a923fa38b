"""Runs that differ in a few numbers only, as columns that are checked and prepared together.

The conditions of a scene, its system and its start take arrays in place of numbers, and then give
the same bits. This holds for the keys and scenes of ``columns_of``. Runs that violate a condition,
or are close to a stability limit, are checked by their scene one by one, which reports errors.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ab_sim.analysis.metrics.judging import JudgedRuns, RunNumbers
from ab_sim.base.errors import SceneError
from ab_sim.design.batch.lane_group import LaneStarts
from ab_sim.design.batch.prepared_run import PreparedRun, StepPlanKey
from ab_sim.engine.integrate.choose import (
    USUAL,
    direction_of,
    stability_limit,
    step_limiting_rates,
    top_speed,
)
from ab_sim.engine.integrate.registry import AUTO, stepper_named
from ab_sim.model.dynamics.assemble import linear_rates
from ab_sim.model.dynamics.system import has_contact, has_gravity, has_motor
from ab_sim.model.equations.planar import Planar
from ab_sim.model.spindle import Ramp
from ab_sim.scene.bounds import bounds_at
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene, conditions

_ANGLES = "start.ball_angles"
"""Key of the start angles, the only one with a list per run."""
_BELOW_LIMIT = 0.98
"""Fraction of the stability limit up to which a step is certainly accepted, as ``largest_step``
rounds down to three digits."""
_CHECKED_AT_ONCE = 2048
"""Number of runs per block; each needs some hundred numbers temporarily."""


class RunColumns:
    """Runs of a scene with other values at some keys; see ``columns_of``.

    Parameters
    ----------
    base
        Prepared run of the scene without variations.
    values
        Column per key, shape (runs,), or (runs, entries) for lists.
    valid
        Indices of the runs that can be computed in columns, rising.
    """

    def __init__(
        self,
        base: PreparedRun,
        values: Mapping[str, np.ndarray],
        valid: np.ndarray,
    ) -> None:
        self.first, self.valid = base, valid
        self._values = values

    def starts(self, rows: np.ndarray) -> LaneStarts:
        """Return the start data of the runs with some indices."""
        run = self.first.with_numbers_of(_scene_of_columns(self.first.scene, self._values, rows))
        return LaneStarts.of_columns(run, len(rows))

    def step_plan_keys(self, rows: np.ndarray) -> Sequence[StepPlanKey]:
        """Return the step plan key, which is common to all runs."""
        return [self.first.step_plan_key]

    def judged(self, rows: np.ndarray) -> JudgedRuns:
        """Return the data that metrics need of the runs with some indices."""
        scenes = _LazyScenes(self.first.scene, self._values, rows)
        return JudgedRuns(scenes, self.first.steps, self._numbers(rows))

    def _numbers(self, rows: np.ndarray) -> RunNumbers:
        """Return the scene values of runs that metrics use, from a scene of columns."""
        numbers = RunNumbers.of([_scene_of_columns(self.first.scene, self._values, rows)])
        of_balls, balls = ("moments", "heights", "start_angles"), self.first.balls

        def columns(name: str, value: np.ndarray) -> np.ndarray:
            shape = (len(rows), balls) if name in of_balls else (len(rows),)
            return np.array(np.broadcast_to(value[0].T, shape), order="C")

        return RunNumbers(*(columns(*item) for item in numbers._asdict().items()))


class _LazyScenes(Sequence[Scene]):
    """Scenes of some runs, created on access, one at a time.

    Parameters
    ----------
    base
        Scene without variations.
    values
        Column per key, see ``RunColumns``.
    rows
        Indices of the runs.
    """

    def __init__(self, base: Scene, values: Mapping[str, np.ndarray], rows: np.ndarray) -> None:
        self._base, self._values, self._rows = base, values, rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: Any) -> Any:
        row = self._rows[index]
        changes = {key: column[row].tolist() for key, column in self._values.items()}
        return changed_scene(self._base, changes, f"variation {row}")


def columns_of(scene: Scene, values: Mapping[str, Sequence[Any]]) -> RunColumns | None:
    """Return the runs of a scene with varied values that can be computed in columns.

    They need a planar deck without contact and motor, and effects without checks of the whole
    scene. Varied keys may be numbers of effects, the mass and start angles of balls, the race's
    radius, and masses and eccentricity of the rotor.

    Parameters
    ----------
    scene
        Scene, which may be invalid without its variations.
    values
        Values of all runs by dotted key [SI].

    Returns
    -------
    RunColumns | None
        The runs; None if no run can be computed in columns.
    """
    try:
        base = PreparedRun(scene)
    except SceneError:
        return None
    if not values or not _can_vary(base):
        return None
    columns_or_none = {key: _column(base.scene, key, column) for key, column in values.items()}
    if any(column is None for column in columns_or_none.values()):
        return None
    columns = {key: np.asarray(column) for key, column in columns_or_none.items()}
    count = len(next(iter(columns.values())))
    try:
        sure = [
            _sure(base, columns, np.arange(first, min(first + _CHECKED_AT_ONCE, count)))
            for first in range(0, count, _CHECKED_AT_ONCE)
        ]
    except (TypeError, ValueError, SceneError):  # an effect branches on its numbers
        return None
    rows = np.concatenate(sure)
    return RunColumns(base, columns, rows) if len(rows) else None


def _can_vary(base: PreparedRun) -> bool:
    """Return whether runs of a scene can be computed in columns; see ``columns_of``."""
    scene = base.scene
    effects = base.system.effects
    if not isinstance(base.system.deck_model, Planar) or has_gravity(effects):
        return False
    if has_contact(effects) or has_motor(effects):
        return False
    if any(hasattr(effect, "check_scene") for effect in effects):
        return False
    # Steps along a curved profile depend on the cycle, and sensors are not covered here.
    ramps = all(isinstance(part.law, Ramp) for part in base.step_plan_key.scheduled_segments)
    # With an automatic choice, the division of steps may differ from run to run.
    kept = scene.solver.stepper != AUTO or base.stepper is stepper_named(USUAL)
    return base.fits_lane and ramps and not scene.pickups and kept


def _column(scene: Scene, key: str, values: Sequence[Any]) -> np.ndarray | None:
    """Return the values of a key as a column, NaN if not allowed.

    Returns
    -------
    np.ndarray | None
        Column, shape (runs,), or (runs, balls) for start angles; None for a key that cannot be a
        column.
    """
    bounds, balls = bounds_at(scene, key), scene.balls.count
    if bounds is None or key == _ANGLES and balls == 0:
        return None
    of_lists = key == _ANGLES
    if isinstance(values, np.ndarray) and values.dtype.kind in "fi":
        column = values.astype(float)
        if column.shape[1:] != ((balls,) if of_lists else ()):
            return None
    elif of_lists:
        none = [math.nan] * balls
        lists = [v if type(v) in (list, tuple) and len(v) == balls else none for v in values]
        column = np.array([[_number(number) for number in row] for row in lists])
    else:
        column = np.array([_number(value) for value in values])
    return np.where(bounds.hold(column), column, np.nan)


def _number(value: Any) -> float:
    """Return a plain number as a float; NaN for any other value."""
    return float(value) if type(value) in (float, int) and abs(value) < 1e300 else math.nan


def _scene_of_columns(scene: Scene, columns: Mapping[str, np.ndarray], rows: np.ndarray) -> Scene:
    """Return the scene with columns of some runs in place of numbers.

    It is not checked. Sums and products of its numbers give columns, too.
    """
    some: dict[str, Any] = {key: column[rows] for key, column in columns.items()}
    if _ANGLES in some:
        some[_ANGLES] = tuple(some[_ANGLES].T)  # one column per ball
    sections: dict[str, Any] = {
        name: getattr(scene, name).model_copy(update=_of_section(name, some))
        for name in ("rotor", "race", "balls", "start")
    }
    sections["effects"] = {
        name: effect._replace(**_of_section(f"effects.{name}", some))
        for name, effect in scene.effects.items()
    }
    return scene.model_copy(update=sections)


def _of_section(section: str, columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of a section's keys, by the key within the section."""
    return {
        key.removeprefix(f"{section}."): column
        for key, column in columns.items()
        if key.startswith(f"{section}.")
    }


def _sure(base: PreparedRun, columns: Mapping[str, np.ndarray], rows: np.ndarray) -> np.ndarray:
    """Return the rows of runs that are certainly valid, and stable with the stepper of ``base``.

    Other runs may be valid, too; their scenes decide.
    """
    valid = np.ones(len(rows), bool)
    for column in columns.values():
        valid &= np.isfinite(column[rows]).reshape(len(rows), -1).all(axis=1)
    for holds, _ in conditions(_scene_of_columns(base.scene, columns, rows)):
        valid &= holds
    rows = rows[valid]
    run = base.with_numbers_of(_scene_of_columns(base.scene, columns, rows))
    return rows[np.broadcast_to(_stable(run), len(rows))]


def _stable(run: PreparedRun) -> Any:
    """Return a mask of runs whose step is far enough below the limit of stability.

    The stability limit is that of ``check_step``; ``auto`` then does not divide the step.
    """
    stable: Any = True
    rates = linear_rates(run.system, top_speed(run.scene))
    for rate in map(np.atleast_1d, step_limiting_rates(run.stepper, rates).values()):
        # A limit for each direction, rounded like those of ``largest_step``.
        phases = np.where(rate.imag, np.round(np.angle(rate), 3), math.pi)
        _, places, which = np.unique(phases, return_index=True, return_inverse=True)
        limits = [stability_limit(run.stepper, direction_of(one)) for one in rate[places].tolist()]
        steps = np.abs(rate) * run.scene.solver.step
        stable = stable & (steps <= _BELOW_LIMIT * np.array(limits)[which])
    return stable

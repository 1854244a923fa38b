"""Runs that differ in a few numbers only, as columns that are checked and prepared together.

A scene's checks of numbers and the kernel's constants are arithmetic. With arrays they give the
same bits. This holds for the keys and scenes of ``columns_of``, and for values far from a limit.
All other runs are checked by their scene one by one, which reports errors.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, overload

import numpy as np

from ab_sim.analysis.metrics.judging import JudgedRuns, RunNumbers
from ab_sim.base.errors import SceneError
from ab_sim.design.batch.lane_group import LaneStarts
from ab_sim.design.batch.prepared_run import PreparedRun, StepPlanKey
from ab_sim.engine.integrate.choose import USUAL, stability_limit, top_speed
from ab_sim.engine.integrate.registry import AUTO, Stepper, stepper_named
from ab_sim.engine.kernels.constants import flattened, numbers_of
from ab_sim.model.dynamics.assemble import of_ball
from ab_sim.model.dynamics.deck_models.planar import poles_of
from ab_sim.model.dynamics.system import (
    TURNS,
    has_contact,
    has_gravity,
    has_motor,
    layout_of,
)
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.neighbours import reduced
from ab_sim.model.equations.planar import Planar
from ab_sim.model.equations.sums import over_effects
from ab_sim.model.spindle import Ramp
from ab_sim.scene.bounds import bounds_at
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

_ANGLES = "start.ball_angles"
"""Key of the start angles, the only one with a list per run."""
_FAR_FROM_LIMIT, _BELOW_LIMIT = 0.8, 0.98
"""Fractions of a stepper's stability limit up to which a run is certainly stable.

The first is for several sampled directions. The second is for a direction whose limit is known up
to rounding.
"""

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
        self._start = LaneStarts.of([base])

    def starts(self, rows: np.ndarray) -> LaneStarts:
        """Return the start data of the runs with these indices."""
        starts = LaneStarts(*(np.repeat(start, len(rows), axis=0) for start in self._start))
        if _ANGLES in self._values:
            angles = layout_of(self.first.system).angles
            within, turns = _reduced(self._values[_ANGLES][rows])
            starts.state[:, angles], starts.discrete[:, :-1, TURNS] = within, turns
        return starts._replace(constants=self._constants(rows))

    def step_plan_keys(self, rows: np.ndarray) -> Sequence[StepPlanKey]:
        """Return the step plan key, which is common to all runs."""
        return [self.first.step_plan_key]

    def judged(self, rows: np.ndarray) -> JudgedRuns:
        """Return the data that metrics need of the runs with these indices."""
        scenes = _LazyScenes(self.first.scene, self._values, rows)
        return JudgedRuns(scenes, self.first.steps, self._numbers(rows))

    def _constants(self, rows: np.ndarray) -> np.ndarray:
        """Return the kernel's constants of runs, see ``numbers_of``; shape (rows, constants).

        They are computed from a scene whose varied numbers are columns. Numbers that do not vary
        are copied from the base run.
        """
        system, scene = self.first.system, _scene_of_columns(self.first.scene, self._values, rows)
        effects = tuple(scene.effects.values())
        constants = np.tile(numbers_of(system), (len(rows), 1))
        names = [name for name, _ in flattened((system.deck_model, system.effects), "")]
        deck = _deck(scene, self.first)
        parts = {f".0.{name}": value for name, value in deck._asdict().items()}
        for k, effect in enumerate(effects):
            parts |= {f".1.{k}.{name}": value for name, value in effect._asdict().items()}
        for name, value in parts.items():
            if isinstance(value, np.ndarray):
                constants[:, names.index(name)] = value
        n, columns = len(system.balls), constants[:, len(names) :]
        balls = zip(scene.balls.masses, scene.balls.radii, scene.balls.races, strict=True)
        for i, (mass, radius, race) in enumerate(balls):
            height = scene.race.heights[race]
            ball = of_ball(Ball(mass, radius), scene.race.radius, height, effects)
            for k, value in enumerate(ball[1:]):
                columns[:, k * n + i] = value
        return constants

    def _numbers(self, rows: np.ndarray) -> RunNumbers:
        """Return the scene values of runs that metrics use, from a scene of columns."""
        numbers = RunNumbers.of([_scene_of_columns(self.first.scene, self._values, rows)])
        of_balls, balls = ("moments", "heights", "start_angles"), self.first.balls

        def columns(name: str, value: np.ndarray) -> np.ndarray:
            shape = (len(rows), balls) if name in of_balls else (len(rows),)
            return np.array(np.broadcast_to(value[0].T, shape), order="C")

        of_runs = {name: columns(name, value) for name, value in numbers._asdict().items()}
        if _ANGLES in self._values:
            of_runs["start_angles"] = self._values[_ANGLES][rows]
        return RunNumbers(**of_runs)


class _LazyScenes(Sequence[Scene]):
    """Scenes of some runs, created on access.

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

    @overload
    def __getitem__(self, index: int) -> Scene: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Scene]: ...

    def __getitem__(self, index: int | slice) -> Scene | Sequence[Scene]:
        rows = self._rows[index]
        if isinstance(index, slice):
            return _LazyScenes(self._base, self._values, rows)
        changes = {key: column[rows].tolist() for key, column in self._values.items()}
        return changed_scene(self._base, changes, f"variation {rows}")


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
    finite = [np.isfinite(column).reshape(count, -1).all(axis=1) for column in columns.values()]
    try:
        sure = np.all([*finite, _sure(base, columns, count)], axis=0)
    except (TypeError, ValueError):  # an effect branches on its numbers
        return None
    rows = np.flatnonzero(sure)
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
    """Return the scene with columns of some runs in place of numbers, except start angles.

    It is not checked. Sums and products of its numbers give columns, too.
    """
    some = {key: column[rows] for key, column in columns.items()}
    sections: dict[str, Any] = {
        name: getattr(scene, name).model_copy(update=_of_section(name, some))
        for name in ("rotor", "race", "balls")
    }
    sections["effects"] = {
        name: effect._replace(**_of_section(f"effects.{name}", some))
        for name, effect in scene.effects.items()
    }
    return scene.model_copy(update=sections)


def _of_section(section: str, columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the columns of a section's keys, by the key within the section."""
    return {
        key.removeprefix(f"{section}."): column
        for key, column in columns.items()
        if key.startswith(f"{section}.")
    }


def _sure(base: PreparedRun, columns: Mapping[str, np.ndarray], count: int) -> np.ndarray:
    """Return a mask of runs that are certainly valid and stable with the scene's stepper.

    Parameters
    ----------
    base
        Prepared run without variations.
    columns
        Column per key.
    count
        Number of runs.

    Returns
    -------
    np.ndarray
        Booleans, shape (count,). Other runs may be valid, too; their scenes decide.
    """
    sure = np.empty(count, bool)
    for first in range(0, count, _CHECKED_AT_ONCE):
        rows = np.arange(first, min(first + _CHECKED_AT_ONCE, count))
        scene = _scene_of_columns(base.scene, columns, rows)
        sure[rows] = _sound(scene) & _stable(scene, base)
    return sure


def _sound(scene: Scene) -> Any:
    """Return a mask of runs whose sections agree with each other, from a scene of columns.

    The conditions are those of the scene's own checks.
    """
    e, rest = np.asarray(scene.rotor.eccentricity), scene.total_mass - scene.balls.total_mass
    ball_radius = scene.balls.radius
    largest = max(ball_radius) if isinstance(ball_radius, tuple) else ball_radius
    sound = (rest > 0.0) & (scene.eccentric_mass <= rest)
    return sound & ((e == 0.0) | (e >= 1e-12)) & (scene.race.radius > (largest or 0.0))


def _stable(scene: Scene, base: PreparedRun) -> Any:
    """Return a mask of runs for which the stepper is certainly stable, from a scene of columns.

    ``choose_stepper`` would accept these runs without another division of the step.
    """
    effects, step, stepper = tuple(scene.effects.values()), scene.solver.step, base.stepper
    rest = scene.total_mass - scene.balls.total_mass
    poles = poles_of(effects, _deck(scene, base), rest)
    whirl = np.abs(poles).max(axis=0) + top_speed(scene)
    stable = (poles.real.max(axis=0) <= 0.0) & (whirl * step <= _FAR_FROM_LIMIT * _reach(stepper))
    if stepper.solves_drag:
        return stable
    drag_limit = _BELOW_LIMIT * stability_limit(stepper)
    return stable & (_fastest_drag(scene, effects) * step <= drag_limit)


def _deck(scene: Scene, base: PreparedRun) -> Any:
    """Return the deck model with the numbers of a scene of columns; without gravity, no sag."""
    e = scene.rotor.eccentricity
    return base.system.deck_model._replace(
        total_mass=scene.total_mass, unbalance=scene.eccentric_mass * e, eccentricity=e
    )


def _fastest_drag(scene: Scene, effects: tuple[Any, ...]) -> Any:
    """Return an upper bound of ``assemble.drag_rate`` [1/s]."""
    inertia, coupled, drag = math.inf, 0.0, 0.0
    for mass, radius in zip(scene.balls.masses, scene.balls.radii, strict=True):
        ball: Any = Ball(mass, radius)
        spin = over_effects(effects, "ball_inertia", 0.0, ball)
        inertia = np.minimum(inertia, mass + spin)
        coupled = coupled + mass * mass / scene.total_mass
        drag = np.maximum(drag, np.abs(over_effects(effects, "ball_drag", 0.0, ball)))
    # The smallest eigenvalue of diag(mu) - m m^T / M is at least the smallest mu minus |m|^2 / M.
    least = np.asarray(inertia - coupled)
    with np.errstate(divide="ignore"):
        return np.where(least > 0.0, drag / least, np.inf) if scene.balls.count else 0.0


@functools.lru_cache(maxsize=64)
def _reach(stepper: Stepper) -> float:
    """Return the radius of the stability region over all directions without growth."""
    directions = [complex(math.cos(a), math.sin(a)) for a in np.linspace(0.5, 0.999, 31) * math.pi]
    return min(stability_limit(stepper, eigenvalue) for eigenvalue in (-1.0, *directions))


def _reduced(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angles reduced to one turn [rad], and the removed turns; see ``neighbours.reduced``.

    Angles are reduced one by one, because NumPy's sine may differ from the C library's in the last
    bit.
    """
    within, turns = angles.copy(), np.zeros(angles.shape)
    for index in zip(*np.nonzero(np.abs(angles) > math.pi), strict=True):
        within[index], turns[index] = reduced(float(angles[index]))
    return within, turns

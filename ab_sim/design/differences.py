"""Derivatives by differences of whole runs, their uncertainty, and the keys that may vary.

A key is moved up and down by h and by h / 2. The derivative is Richardson's extrapolation of both
central differences. Its uncertainty is the larger of two errors, plus that of rounding:

- the difference of both central differences, which is the error of the coarser one;
- half the jump of the slope at a kink. The difference of the slopes above and below falls with h
  if a result is smooth, but not at a kink.

Rounding is measured with runs that are so close together that smooth changes are negligible: Moré
and Wild (2011), SIAM J. Sci. Comput. 33, 1292. Collisions amplify it. The step h is the cube root
of the relative rounding error: truncation and rounding then contribute about equally to the error
of a central difference.

Entries of lists are counted from 0: ``balls.mass.1``, ``mounts.0.stiffness.2``. If a scene has one
number for all entries, each entry is this number, and changing an entry makes a list.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, SceneError, nearest, short
from ab_sim.design.batch.prepared_run import PreparedRun
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.changes import value_at
from ab_sim.scene.keys import SceneKey, key_starts_with, scene_keys
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

_MOVING = ("rotor", "deck", "mounts", "race", "balls", "effects", "start", "profile")
"""Sections whose numbers act on the motion."""

ANGLES = "start.ball_angles"
"""Key of the start angles, which have values even if the scene does not name them."""
IN_SPACE = ("rotor.height", "race.height")
"""Keys without a meaning for a deck that moves in the plane of the disc."""
_MOTOR_INTEGRAL = "start.motor_integral"
"""Key without a meaning in a scene without a motor."""


class RealKey(NamedTuple):
    """Number of a scene, with its key and unit."""

    key: str
    """Dotted key."""
    value: float
    """Value in the scene, SI."""
    unit: str
    """SI unit; "1" for a number without dimension."""


def real_key(scene: Scene, key: str) -> RealKey:
    """Return a number of a scene by its key.

    Raises
    ------
    InputError
        The key does not exist, is a list or not a real number, or does not act on the motion; the
        message lists the keys.
    """
    parts = key.split(".")
    section = parts[0]
    if section not in _MOVING:
        if section in type(scene).model_fields:
            raise InputError(
                f"key {short(key)}: {section} does not act on the motion, or has no derivative; "
                f"take a key of one of: {', '.join(_MOVING)}"
            )
        raise _unknown(scene, key)
    raw = _plain(scene)
    try:
        value = value_at(raw, key)
    except SceneError:  # a list has no such entry
        raise _unknown(scene, key) from None
    if isinstance(value, list) and value and isinstance(value[0], float):
        raise InputError(f"key {short(key)}: has {len(value)} numbers; name one, e.g. {key}.0")
    above = key.rpartition(".")[0]
    if value is None and above and (_row(parts) is None or value_at(raw, above) is None):
        raise _unknown(scene, key)
    if type(value) is not float:
        what = "is not given in this scene" if value is None else "is not a real number"
        raise InputError(f"key {short(key)}: {what}{_near(scene, key)}")
    return RealKey(key, value, _unit(parts))


def real_keys(scene: Scene) -> list[RealKey]:
    """Return all numbers of a scene that act on its motion and may change by themselves.

    A number for all balls or all axes is included once; lists are included entry by entry.
    """
    raw = scene.with_plain(_MOVING)
    keys = [
        RealKey(key, value, _unit(key.split(".")))
        for section in _MOVING
        for key, value in _inside(section, raw.get(section))
        if (scene.deck is not None or key not in IN_SPACE)
        and (key != _MOTOR_INTEGRAL or "motor" in scene.effects)
    ]
    if scene.start.ball_angles is None:
        angles = enumerate(start_angles(scene))
        keys += [RealKey(f"{ANGLES}.{i}", angle, "rad") for i, angle in angles]
    return keys


def checked_keys(scene: Scene, keys: Sequence[str]) -> list[RealKey]:
    """Return the numbers of a scene with given keys, which are checked.

    Raises
    ------
    InputError
        ``keys`` is not a list or is empty, or a key is invalid, see ``real_key``.
    """
    if isinstance(keys, str) or not keys:
        raise InputError(f"keys = {keys!r}: must be a list of the scene's keys, at least one")
    return [real_key(scene, key) for key in keys]


def moved(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with other values by key, SI.

    Raises
    ------
    SceneError
        A value is not allowed.
    """
    changes: dict[str, object] = dict(values)
    if scene.start.ball_angles is None and any(key.startswith(ANGLES) for key in values):
        changes = {ANGLES: list(start_angles(scene)), **values}
    return changed_scene(scene, changes, scene.name)


def _plain(scene: Scene) -> dict[str, Any]:
    """Return the sections that act on the motion as plain values, with the balls' start angles."""
    raw: dict[str, Any] = scene.with_plain(_MOVING)
    if scene.start.ball_angles is None and scene.balls.count:
        raw["start"]["ball_angles"] = list(start_angles(scene))
    return raw


def _inside(key: str, value: Any) -> Iterator[tuple[str, float]]:
    """Yield the dotted key and the value of each real number in nested mappings and lists."""
    if type(value) is float:
        yield key, value
    elif isinstance(value, dict | list):
        for name, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _inside(f"{key}.{name}", inner)


def _unit(parts: Sequence[str]) -> str:
    """Return the unit of a key; an entry of a list has that of the list."""
    row = _row(parts) or _row(parts[:-1])
    return "1" if row is None or row.unit == "-" else row.unit


def _row(parts: Sequence[str]) -> SceneKey | None:
    """Return the description of the key with the given parts; None if there is no such key."""
    rows = (row for row in scene_keys() if key_starts_with(row.key.split("."), parts))
    return next((row for row in rows if row.key.count(".") == len(parts) - 1), None)


def _unknown(scene: Scene, key: str) -> InputError:
    """Return the error for a key without a number in the scene."""
    return InputError(f"key {short(key)}: this scene has no such number{_near(scene, key)}")


def _near(scene: Scene, key: str) -> str:
    """Return the end of an error message: the nearest key, and all keys of the scene."""
    all_keys = [real.key for real in real_keys(scene)]
    return f"{nearest(key, all_keys)}; it has {', '.join(all_keys)}"


def scale_of(real: RealKey) -> float:
    """Return a change that counts as large for a number, in the number's unit.

    It is 1 rad for angles, otherwise the magnitude of the number, or ``ZERO`` by unit for 0.
    """
    if real.unit == "rad":
        return 1.0
    return abs(real.value) or ZERO.get(real.unit, 0.1)


ZERO = {"m": 1e-4, "kg": 1e-4, "kg m^2": 1e-7, "N m s/rad": 1e-4}
"""Large changes of numbers that are 0, by unit."""


_LEAST, MOST = 1e-5, 1e-2
"""Limits of the step h, as fractions of the key's ``scale_of``."""
FACTORS = (1.0, 1 / 8, 8.0)
"""Factors on the step h, tried from left to right until all derivatives are certain enough."""
ENOUGH = 1e-4
"""Uncertainty below which no further step is tried, as a fraction of the derivative."""
_NO_INFLUENCE = 1e-7
"""Limit like ``ENOUGH`` for keys with little influence, as a fraction of result / ``scale_of``."""
_NEARBY = 1e-10
"""Distance between the runs that measure rounding, as a fraction of ``scale_of``."""
ROUNDING, _ONE_SIDED = 4.0, 10.0
"""Twice the standard deviation of a central and of a one-sided derivative, times h, relative to
that of a result."""

Results = Callable[[Sequence[Scene]], np.ndarray]
"""Function that returns results of scenes' runs, shape (scenes, rows, samples); NaN for failed
runs."""


class DerivativeEstimate(NamedTuple):
    """Derivatives of a run's results by keys."""

    derivatives: np.ndarray
    """Derivatives, shape (rows, keys, samples); NaN where runs failed."""
    uncertainties: np.ndarray
    """Uncertainties of the derivatives, same shape; infinite where runs failed."""


def differentiated(
    scene: Scene, keys: Sequence[RealKey], here: np.ndarray, results: Results
) -> DerivativeEstimate:
    """Differentiate results of a scene's run.

    Parameters
    ----------
    scene
        Scene with a named stepper, see ``with_stepper``.
    keys
        Values to change.
    here
        Results of the scene's own run, shape (rows, samples).
    results
        Function that runs scenes, see ``Results``.
    """
    nearby = _nearby(scene, keys)
    noise = _noise_of(np.array([here, *(results(nearby) if nearby else ())]))
    size = np.abs(here).max(axis=1)
    relative = noise.max(axis=1)[size > 0.0] / size[size > 0.0]
    # Truncation grows with h^2 and rounding with 1 / h: their sum is least near the cube root. The
    # median over results keeps one noisy channel from spoiling the step of all.
    share = np.clip(np.median(relative) ** (1 / 3), _LEAST, MOST) if len(relative) else _LEAST
    derivatives = np.full((len(keys), *here.shape), np.nan)
    uncertain = np.full(derivatives.shape, np.inf)
    uncertain_keys = list(range(len(keys)))
    for factor in FACTORS:
        steps = {k: min(share * factor, MOST) * scale_of(keys[k]) for k in uncertain_keys}
        scenes = {k: _moved_both_ways(scene, keys[k], step) for k, step in steps.items()}
        runs = iter(results([scene for of_key in scenes.values() for scene in of_key if scene]))
        missing = np.full(here.shape, np.nan)
        for k, step in steps.items():
            four = np.array([next(runs) if scene else missing for scene in scenes[k]])
            possible = scenes[k][0] is not None, scenes[k][3] is not None
            derivative, uncertainty = _difference(here, four, step, noise, possible)
            better = uncertainty < uncertain[k]
            derivatives[k][better], uncertain[k][better] = derivative[better], uncertainty[better]
        uncertain_keys = [
            k
            for k in steps
            if not _is_certain(derivatives[k], uncertain[k], size / scale_of(keys[k]))
        ]
        if not uncertain_keys:
            break
    return DerivativeEstimate(derivatives.swapaxes(0, 1), uncertain.swapaxes(0, 1))


def with_stepper(scene: Scene) -> Scene:
    """Return the scene with its stepper named, so that runs with changed keys use the same one.

    Raises
    ------
    SceneError
        A controller decides the speed during the run.
    """
    SpeedSchedule.of_scene(scene)
    scene, _ = resolve_accuracy(scene)
    stepper = choose_stepper(scene, system_of(scene)).stepper.name
    return scene.model_copy(update={"solver": scene.solver.model_copy(update={"stepper": stepper})})


def prepared_runs(scenes: Sequence[Scene]) -> dict[int, PreparedRun]:
    """Prepare runs of scenes; leave out scenes that their solver cannot run.

    Returns
    -------
    dict[int, PreparedRun]
        Prepared runs by the index of their scene.
    """
    prepared = {}
    for number, scene in enumerate(scenes):
        try:
            prepared[number] = PreparedRun(scene)
        except SceneError:
            continue
    return prepared


def _difference(
    here: np.ndarray,
    four: np.ndarray,
    step: float,
    noise: np.ndarray,
    possible: tuple[bool, bool],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivative by one key and its uncertainty, each with the shape of ``here``.

    Parameters
    ----------
    here
        Results of the scene itself, shape (rows, samples).
    four
        Results with the key moved by h, h / 2, -h / 2, -h; NaN on a side without a valid scene, and
        for runs that failed or have no value.
    step
        Step h, in the key's unit.
    noise
        Standard deviation of a result.
    possible
        Whether the scene is valid with the key moved up, and down.
    """
    slopes = (four - here) / (step * np.array([1.0, 0.5, -0.5, -1.0])[:, None, None])
    wide, near = (slopes[0] + slopes[3]) / 2.0, (slopes[1] + slopes[2]) / 2.0
    derivative = near + (near - wide) / 3.0
    # Slopes above and below differ by f'' h and f'' h / 2 if the result is smooth, which cancels
    # here. At a kink both differ by its jump, which remains.
    jump = 2.0 * (slopes[1] - slopes[2]) - (slopes[0] - slopes[3])
    uncertainty = np.maximum(np.abs(near - wide), np.abs(jump) / 2.0) + ROUNDING * noise / step
    for wide, near, other in (
        (slopes[0], slopes[1], possible[1]),
        (slopes[3], slopes[2], possible[0]),
    ):
        # At the end of a key's range, only one-sided differences are possible. If a run of the
        # other side failed, there is no derivative.
        if other:
            continue
        single = np.isnan(derivative)
        derivative = np.where(single, 2.0 * near - wide, derivative)
        one_sided = np.abs(near - wide) + _ONE_SIDED * noise / step
        uncertainty = np.where(single, one_sided, uncertainty)
    return derivative, np.where(np.isnan(uncertainty), np.inf, uncertainty)


def _is_certain(derivative: np.ndarray, uncertainty: np.ndarray, size: np.ndarray) -> bool:
    """Return whether all derivatives are certain enough, so that no other step is tried.

    Parameters
    ----------
    derivative, uncertainty
        Shape (rows, samples).
    size
        Magnitude of the result per ``scale_of`` the key, shape (rows,).
    """
    most = np.nan_to_num(np.abs(derivative)).max(axis=1)
    enough = np.maximum(ENOUGH * most, _NO_INFLUENCE * size)
    return bool((uncertainty.max(axis=1) <= enough).all())


def _moved_both_ways(scene: Scene, key: RealKey, step: float) -> list[Scene | None]:
    """Return scenes with the key moved by h, h / 2, -h / 2, -h; None on a side that is invalid."""
    scenes: list[Scene | None] = []
    for moves in ((step, step / 2.0), (-step / 2.0, -step)):
        try:
            scenes += [moved(scene, {key.key: key.value + move}) for move in moves]
        except SceneError:
            scenes += [None, None]
    return scenes


def _nearby(scene: Scene, keys: Sequence[RealKey]) -> list[Scene]:
    """Return seven scenes whose keys change in small equal steps; empty if no key can change.

    A key at its upper bound decreases. If the keys cannot change together, only one changes.
    """
    moves = {}
    for key in keys:
        reach = 8 * _NEARBY * scale_of(key)
        up, _, _, down = _moved_both_ways(scene, key, reach)
        if up or down:
            moves[key] = _NEARBY * scale_of(key) * (1.0 if up else -1.0)
    for chosen in (list(moves), *([key] for key in moves)):
        try:
            return [
                moved(scene, {key.key: key.value + k * moves[key] for key in chosen})
                for k in range(1, 8)
            ]
        except SceneError:
            continue
    return []


def _noise_of(near: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the noise in results; infinite if a run failed.

    Fourth differences remove the smooth part, and multiply the variance of the noise by 8! / 4!^2
    = 70.

    Parameters
    ----------
    near
        Results of eight runs whose keys change in equal steps, shape (8, rows, samples). With fewer
        runs, the rounding error of a result is returned.

    Returns
    -------
    np.ndarray
        Standard deviations, shape (rows, samples).
    """
    rounding: np.ndarray = np.finfo(float).eps * np.abs(near[0])
    if len(near) < 8:
        return rounding
    fourth = np.sqrt((np.diff(near, 4, axis=0) ** 2).mean(axis=0) / 70.0)
    return np.where(np.isnan(fourth), np.inf, np.maximum(fourth, rounding))

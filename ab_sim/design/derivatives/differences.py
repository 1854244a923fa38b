"""Derivatives by differences of whole runs, with their uncertainty.

A key is moved up and down by h and by h / 2. The derivative is Richardson's extrapolation of both
central differences. Its uncertainty is the larger of two errors, plus that of rounding:

- the difference of both central differences, which is the error of the coarser one;
- half the jump of the slope at a kink. The difference of the slopes above and below falls with h
  if a result is smooth, but not at a kink.

Rounding is measured with runs that are so close together that smooth changes are negligible: Moré
and Wild (2011), SIAM J. Sci. Comput. 33, 1292. Collisions amplify it. The step h is the cube root
of the relative rounding error: truncation and rounding then contribute about equally to the error
of a central difference.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.design.batch.prepared_run import PreparedRun
from ab_sim.design.derivatives.keys import RealKey, moved, moved_together, scale_of
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.model import Scene

LEAST, MOST = 1e-5, 1e-2
"""Limits of the step h, as fractions of the key's ``scale_of``."""
FACTORS = (1.0, 1 / 8, 8.0)
"""Factors of the step, tried in this order until all derivatives are certain enough."""
ENOUGH = 1e-4
"""Uncertainty below which no further step is tried, as a fraction of the derivative."""
NO_INFLUENCE = 1e-7
"""Same limit for keys with little influence, as a fraction of the result per ``scale_of``."""
NEARBY = 1e-10
"""Distance between the runs that measure rounding, as a fraction of ``scale_of``."""
ROUNDING, ONE_SIDED = 4.0, 10.0
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

    Args:
        scene: scene with a named stepper, see ``with_stepper``.
        keys: values to change.
        here: results of the scene's own run, shape (rows, samples).
        results: function that runs scenes, see ``Results``.
    """
    nearby = _nearby(scene, keys)
    noise = _noise_of(np.array([here, *(results(nearby) if nearby else ())]))
    size = np.abs(here).max(axis=1)
    relative = noise.max(axis=1)[size > 0.0] / size[size > 0.0]
    share = np.clip(np.median(relative) ** (1 / 3), LEAST, MOST) if len(relative) else LEAST
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

    Raises:
        SceneError: a controller decides the speed during the run.
    """
    SpeedSchedule.of_scene(scene)
    scene, _ = resolve_accuracy(scene)
    stepper = choose_stepper(scene, system_of(scene)).stepper.name
    return scene.model_copy(update={"solver": scene.solver.model_copy(update={"stepper": stepper})})


def prepared_runs(scenes: Sequence[Scene]) -> dict[int, PreparedRun]:
    """Prepare runs of scenes; leave out scenes that their solver cannot run.

    Returns:
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
    """Return a derivative and its uncertainty.

    Args:
        here: results of the scene itself.
        four: results with the key moved by h, h / 2, -h / 2, -h; NaN on a side without a valid
            scene, and for runs that failed or have no value.
        step: step h, in the key's unit.
        noise: standard deviation of a result.
        possible: whether the scene is valid with the key moved up, and down.
    """
    slopes = (four - here) / (step * np.array([1.0, 0.5, -0.5, -1.0])[:, None, None])
    wide, near = (slopes[0] + slopes[3]) / 2.0, (slopes[1] + slopes[2]) / 2.0
    derivative = near + (near - wide) / 3.0
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
        one_sided = np.abs(near - wide) + ONE_SIDED * noise / step
        uncertainty = np.where(single, one_sided, uncertainty)
    return derivative, np.where(np.isnan(uncertainty), np.inf, uncertainty)


def _is_certain(derivative: np.ndarray, uncertainty: np.ndarray, size: np.ndarray) -> bool:
    """Return whether all rows are certain enough, so that no other step is tried.

    Args:
        derivative, uncertainty: shape (rows, samples).
        size: magnitude of the result per ``scale_of`` the key, shape (rows,).
    """
    most = np.nan_to_num(np.abs(derivative)).max(axis=1)
    enough = np.maximum(ENOUGH * most, NO_INFLUENCE * size)
    return bool((uncertainty.max(axis=1) <= enough).all())


def _moved_both_ways(scene: Scene, key: RealKey, step: float) -> list[Scene | None]:
    """Return scenes with the key moved by h, h / 2, -h / 2, -h; None on a side that is invalid."""
    scenes: list[Scene | None] = []
    for moves in ((step, step / 2.0), (-step / 2.0, -step)):
        try:
            scenes += [moved(scene, key.key, key.value + move) for move in moves]
        except SceneError:
            scenes += [None, None]
    return scenes


def _nearby(scene: Scene, keys: Sequence[RealKey]) -> list[Scene]:
    """Return seven scenes in a line, their keys moved a little; none if keys cannot move.

    A key at its upper bound moves down. If keys cannot move together, one moves alone.
    """
    moves = {}
    for key in keys:
        reach = 8 * NEARBY * scale_of(key)
        up, _, _, down = _moved_both_ways(scene, key, reach)
        if up or down:
            moves[key] = NEARBY * scale_of(key) * (1.0 if up else -1.0)
    for chosen in (list(moves), *([key] for key in moves)):
        try:
            return [
                moved_together(scene, {key.key: key.value + k * moves[key] for key in chosen})
                for k in range(1, 8)
            ]
        except SceneError:
            continue
    return []


def _noise_of(near: np.ndarray) -> np.ndarray:
    """Return the standard deviation of results by eight runs in a line; infinite if one failed.

    Fourth differences remove the smooth part, and multiply the variance of the noise by 8! / 4!^2
    = 70.
    """
    rounding: np.ndarray = np.finfo(float).eps * np.abs(near[0])
    if len(near) < 8:
        return rounding
    fourth = np.sqrt((np.diff(near, 4, axis=0) ** 2).mean(axis=0) / 70.0)
    return np.where(np.isnan(fourth), np.inf, np.maximum(fourth, rounding))

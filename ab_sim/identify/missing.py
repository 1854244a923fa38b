"""Which effect would explain what a fit leaves: each that the scene does not have is tried once."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim.errors import AbSimError
from ab_sim.identify.forward import MOTOR, Place
from ab_sim.identify.parameters import Parameter
from ab_sim.identify.problem import Problem
from ab_sim.identify.residuals import total_z, whiteness_of
from ab_sim.identify.result import TriedEffect
from ab_sim.identify.stages import Tell, minimise
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes, effect_parameters

SIZES = 10.0 ** np.arange(-12.0, 13.0)
"""Of a parameter whose size nobody knows: the one that changes the signals as much as the noise."""
TRIAL_STEPS = 15
STEEL = 7800.0
"""kg/m^3: of balls whose radius the scene does not give, where an effect needs it."""
LIMIT = 1e3
"""Of a parameter, in units of the size at which it begins to be seen."""


def tried_effects(
    problem: Problem, values: np.ndarray, free: Sequence[int], tell: Tell
) -> tuple[TriedEffect, ...]:
    """Effects by how much they explain, the best first.

    Args:
        problem: with its noise.
        values: of its parameters, as fitted [SI].
        free: numbers of those that were fitted.
        tell: progress.
    """
    names = [name for name in effect_classes() if name not in problem.scene.effects]
    names = [name for name in names if name != MOTOR]
    residuals = problem.residuals(values)
    square, before = float(residuals @ residuals), _z(problem, values)
    found = []
    for done, name in enumerate(names):
        tell(f"without {name}", done, len(names))
        try:
            found.append(_tried(problem, values, free, name, square, before))
        except AbSimError as error:
            reason = str(error).splitlines()[0]
            found.append(TriedEffect(name, 0.0, 0.0, before, {}, reason))
    count = math.log(len(residuals))
    # As by the Bayesian information criterion: each further parameter has to be worth it.
    return tuple(sorted(found, key=lambda each: len(each.values) * count - each.drop))


def _tried(
    problem: Problem, values: np.ndarray, free: Sequence[int], name: str, square: float,
    before: float,
) -> TriedEffect:  # fmt: skip
    fields = {
        field: about
        for field, about in effect_parameters(effect_classes()[name]).items()
        if about.get("type") == "number" and about.get("default", 0.0) == 0.0
    }
    at_rest = {field: 0.0 for field, about in fields.items() if "default" not in about}
    lowest = {field: _least(about) for field, about in fields.items()}
    bare = _with_effect(problem.scene, name, {k: max(v, lowest[k]) for k, v in at_rest.items()})
    other = Problem(bare, problem.common, problem.recordings, problem.noise)
    more = [
        Parameter(
            f"effects.{name}.{field}", str(about.get("unit", "1")), size, size,
            max(-LIMIT * size, _least(about)), min(LIMIT * size, about.get("maximum", np.inf)),
            Place(f"effects.{name}.{field}"),
        )
        for field, about in fields.items()
        if (size := _size(other, values, f"effects.{name}.{field}", _least(about)))
    ]  # fmt: skip
    count = len(problem.common)
    whole = Problem(bare, [*problem.common, *more], problem.recordings, problem.noise)
    begin = np.concatenate([values[:count], [each.start for each in more], values[count:]])
    numbers = [j if j < count else j + len(more) for j in free]
    numbers += range(count, count + len(more))
    fits = [minimise(whole, begin, sorted(numbers), TRIAL_STEPS)]
    if more and more[0].low < 0.0:
        begin[count] = -more[0].start
        fits.append(minimise(whole, begin, sorted(numbers), TRIAL_STEPS))
    best = min(fits, key=lambda fit: fit.cost)
    after = _z(whole, best.values)
    drop = square - 2.0 * best.cost
    explains = (before - max(after, 0.0)) / before if before > 0.0 and drop > 0.0 else 0.0
    fitted = best.values[count : count + len(more)].tolist()
    return TriedEffect(
        name, min(max(explains, 0.0), 1.0), drop, after,
        {each.name: value for each, value in zip(more, fitted, strict=True)},
    )  # fmt: skip


def _least(about: dict[str, Any]) -> float:
    found: float = about.get("minimum", about.get("exclusiveMinimum", -np.inf))
    return found


def _with_effect(scene: Scene, name: str, parameters: dict[str, float]) -> Scene:
    changes: dict[str, Any] = {f"effects.{name}": parameters}
    if effect_classes()[name].uses_ball_radius and scene.balls.radius is None and scene.balls.count:
        changes["balls.radius"] = [
            (3.0 * mass / (4.0 * math.pi * STEEL)) ** (1.0 / 3.0) for mass in scene.balls.masses
        ]
    return changed_scene(scene, changes, f"with {name}")


def _size(problem: Problem, values: np.ndarray, key: str, least: float) -> float:
    """At which a parameter is seen: where signals change by about their noise; 0: at none."""
    best, nearest = 0.0, math.inf
    bare = [problem.simulated(k, values) for k in range(len(problem.recordings))]
    for size in SIZES[SIZES >= least].tolist():
        changes = []
        for k, (shown, noise) in enumerate(zip(bare, problem.noise, strict=True)):
            moved = problem.simulated(k, values, {key: size})
            if shown is None or moved is None:
                return best
            changes.append(float(np.sqrt(np.mean((moved - shown) ** 2))) / noise)
        change = max(changes)
        if change > 0.0 and abs(math.log(change)) < nearest:
            best, nearest = size, abs(math.log(change))
        if change > 100.0:
            break
    return best


def _z(problem: Problem, values: np.ndarray) -> float:
    found = []
    for k, measured in enumerate(problem.recordings):
        shown = problem.simulated(k, values)
        if shown is not None:
            left = measured.signals - shown
            found.append(whiteness_of(left, measured.rms, measured.name))
    return total_z(found) if len(found) == len(problem.recordings) else math.inf

"""Missing effects: each effect that the scene lacks is tried once as an explanation of residuals.

Unknown parameters of a recording are tried as well, because a rotated or late sensor looks like a
wrong drive.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import AbSimError
from ab_sim.base.presentation import Progress
from ab_sim.identification.forward import MOTOR, KeyPlace
from ab_sim.identification.measured import NUISANCES
from ab_sim.identification.parameters import FitParameter
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import total_z, whiteness_over
from ab_sim.identification.result import TriedEffect
from ab_sim.identification.stages import Fitted, minimise
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes, effect_parameters

SIZES = 10.0 ** np.arange(-12.0, 13.0)
"""Candidate sizes of a parameter of unknown magnitude.

The size is chosen at which the signals change by about their noise.
"""
TRIAL_STEPS = 15
STEEL = 7800.0
"""Density of balls [kg/m^3], used if the scene gives no radius and an effect needs it."""
EQUAL, UNEQUAL = "suspension", "unequal_suspension"
"""Alternative suspensions; a scene has one or the other."""
APART, TINY = 0.01, 1e-9
"""Initial relative difference of unequal springs, and the smallest damping."""
ALIKE = 2.0
"""Difference of sums of squares, in noise variances, below which effects explain equally well."""
BALLS_ONLY = {
    *("ball_drag", "ball_inertia", "friction_coefficient"),
    *("race_shape", "race_arc", "restitution"),
}
"""Methods of effects that act on balls only."""
LIMIT = 1e3
"""Largest value of a parameter in units of the size at which it becomes visible."""


class _Trial(NamedTuple):
    """Scene with an additional effect."""

    scene: Scene
    common: tuple[FitParameter, ...]
    """Fitted parameters of the scene: the remaining earlier ones, then those of the effect."""
    more: tuple[FitParameter, ...]
    """Parameters of the effect."""


def tried_effects(
    problem: Problem, values: np.ndarray, free: Sequence[int], white: Sequence[bool], tell: Progress
) -> tuple[TriedEffect, ...]:
    """Try the missing effects and return them, the best explanation first.

    Args:
        problem: problem with its noise.
        values: fitted values of its parameters [SI].
        free: indices of the fitted parameters.
        white: whether the residuals are noise, for each recording.
        tell: progress callback.
    """
    balls = any(measured.with_balls for measured in problem.recordings)
    names = [
        name
        for name, effect in effect_classes().items()
        if name not in (*problem.scene.effects, MOTOR) and (balls or not _needs_balls(effect))
    ]
    # Iterate the fit without an effect first, so that this gain is not credited to an effect.
    without = minimise(problem, values, free, TRIAL_STEPS)
    before = _z(problem, without.values)
    trials = []
    for done, name in enumerate(names):
        tell(f"tried with {name}", done, len(names))
        try:
            trial = _trial(problem, without.values, name)
            trials.append(_tried(problem, without, free, name, trial, before))
        except AbSimError as error:
            reason = str(error).splitlines()[0]
            trials.append(TriedEffect(name, 0.0, 0.0, before, {}, reason))
    for number, measured in enumerate(problem.recordings):
        if white[number]:
            continue
        for nuisance in NUISANCES:
            if nuisance not in measured.free:
                tell(f"tried with {nuisance} of {measured.name}", len(names), len(names))
                trials.append(_freed(problem, without, free, number, nuisance, before))
    count = math.log(sum(measured.count for measured in problem.recordings))
    # Bayesian information criterion: every additional parameter must pay for itself.
    return tuple(sorted(trials, key=lambda trial: len(trial.values) * count - trial.drop))


def _freed(
    problem: Problem, without: Fitted, free: Sequence[int], number: int, nuisance: str,
    before: float,
) -> TriedEffect:  # fmt: skip
    """Fit with one more free parameter of a recording; return the result like a tried effect."""
    recordings = list(problem.recordings)
    measured = recordings[number]
    recordings[number] = replace(measured, free=(*measured.free, nuisance))
    whole = Problem(problem.scene, problem.common, recordings, problem.noise)
    added = [name for name in whole.names if name not in problem.names]
    name = f"{nuisance} of {measured.name}"
    return _fitted(problem, without, free, whole, added, name, before)._replace(nuisance=nuisance)


def _needs_balls(effect: type[Any]) -> bool:
    """Return whether an effect has no influence without balls."""
    methods = {name for name, member in vars(effect).items() if callable(member) and name[0] != "_"}
    return methods - {"check_scene"} <= BALLS_ONLY


def as_good_as_the_best(tried: Sequence[TriedEffect]) -> list[str]:
    """Return the names of the effects that explain as much as the first, including the first.

    For equal balls, for example, race friction and rolling friction are the same law.
    """
    able = [effect for effect in tried if not effect.failure]
    return [
        effect.name
        for effect in able
        if len(effect.values) == len(able[0].values) and able[0].drop - effect.drop < ALIKE
    ]


def _tried(
    problem: Problem, without: Fitted, free: Sequence[int], name: str, trial: _Trial,
    before: float,
) -> TriedEffect:  # fmt: skip
    whole = Problem(trial.scene, trial.common, problem.recordings, problem.noise)
    added = [parameter.name for parameter in trial.more]
    return _fitted(problem, without, free, whole, added, name, before)


def _fitted(
    problem: Problem, without: Fitted, free: Sequence[int], whole: Problem, more: Sequence[str],
    name: str, before: float,
) -> TriedEffect:  # fmt: skip
    """Fit a problem with additional parameters, and compare it with the earlier fit."""
    values_by_name = dict(zip(problem.names, without.values.tolist(), strict=True))
    begin = np.array(
        [values_by_name.get(parameter.name, parameter.start) for parameter in whole.parameters]
    )
    fitted = {problem.names[j] for j in free} | {*more}
    numbers = [j for j, parameter in enumerate(whole.parameters) if parameter.name in fitted]
    places = [whole.names.index(name) for name in more]
    fits = [minimise(whole, begin, numbers, TRIAL_STEPS)]
    if places and begin[places[0]] != 0.0 and whole.parameters[places[0]].low < 0.0:
        begin[places[0]] = -begin[places[0]]
        fits.append(minimise(whole, begin, numbers, TRIAL_STEPS))
    best = min(fits, key=lambda fit: fit.cost)
    problem.runs += whole.runs
    after, drop = _z(whole, best.values), 2.0 * (without.cost - best.cost)
    if not math.isfinite(after):
        return TriedEffect(name, 0.0, 0.0, after, {}, "every run with it diverges")
    explains = (before - max(after, 0.0)) / before if before > 0.0 and drop > 0.0 else 0.0
    return TriedEffect(
        name, min(max(explains, 0.0), 1.0), drop, after,
        {whole.names[j]: float(best.values[j]) for j in places},
    )  # fmt: skip


def _trial(problem: Problem, values: np.ndarray, name: str) -> _Trial:
    """Return the scene with an effect whose parameters start at a just visible size."""
    if name == UNEQUAL and EQUAL in problem.scene.effects:
        return _unequal(problem, values)
    fields = {
        field: about
        for field, about in effect_parameters(effect_classes()[name]).items()
        if about.get("type") == "number" and about.get("default", 0.0) == 0.0
    }
    sizes = {field: max(0.0, _least(about)) for field, about in fields.items()
             if "default" not in about}  # fmt: skip
    scene = _with_effect(problem.scene, name, sizes)
    other = Problem(scene, problem.common, problem.recordings, problem.noise)
    more = [
        FitParameter(
            f"effects.{name}.{field}", str(about.get("unit", "1")), size, size,
            max(-LIMIT * size, _least(about)), min(LIMIT * size, about.get("maximum", np.inf)),
            KeyPlace(f"effects.{name}.{field}"),
        )
        for field, about in fields.items()
        if (size := _size(other, values, f"effects.{name}.{field}", _least(about)))
    ]  # fmt: skip
    problem.runs += other.runs
    return _Trial(scene, (*problem.common, *more), tuple(more))


def _unequal(problem: Problem, values: np.ndarray) -> _Trial:
    """Return the scene with unequal springs in place of its suspension."""
    scene = changed_scene(problem.scene, problem.scene_values(values), "fitted")
    equal, rest = scene.effects[EQUAL], scene.as_mapping()["effects"]
    assert isinstance(rest, dict)
    k, c = equal.stiffness, max(equal.damping, TINY)
    starts = {
        "stiffness_1": (k * (1 + APART), "N/m"), "stiffness_2": (k * (1 - APART), "N/m"),
        "damping_1": (c, "N s/m"), "damping_2": (c, "N s/m"),
    }  # fmt: skip
    sizes = {name: start for name, (start, _) in starts.items()} | {"axis_angle": 0.5}
    effects = {name: settings for name, settings in rest.items() if name != EQUAL} | {
        UNEQUAL: sizes
    }
    more = [
        FitParameter(f"effects.{UNEQUAL}.{name}", unit, start, start, 0.0, 10.0 * start,
                  KeyPlace(f"effects.{UNEQUAL}.{name}"))
        for name, (start, unit) in starts.items()
    ]  # fmt: skip
    axis = f"effects.{UNEQUAL}.axis_angle"
    more.append(FitParameter(axis, "rad", 0.5, 1.0, -3.2, 3.2, KeyPlace(axis)))
    kept = [
        parameter
        for parameter in problem.common
        if not parameter.name.startswith(f"effects.{EQUAL}.")
    ]
    return _Trial(
        changed_scene(problem.scene, {"effects": effects}, f"with {UNEQUAL}"),
        (*kept, *more), tuple(more),
    )  # fmt: skip


def _least(about: dict[str, Any]) -> float:
    least: float = about.get("minimum", about.get("exclusiveMinimum", -np.inf))
    return least


def _with_effect(scene: Scene, name: str, parameters: dict[str, float]) -> Scene:
    changes: dict[str, Any] = {f"effects.{name}": parameters}
    if effect_classes()[name].uses_ball_radius and scene.balls.radius is None and scene.balls.count:
        changes["balls.radius"] = [
            (3.0 * mass / (4.0 * math.pi * STEEL)) ** (1.0 / 3.0) for mass in scene.balls.masses
        ]
    return changed_scene(scene, changes, f"with {name}")


def _size(problem: Problem, values: np.ndarray, key: str, least: float) -> float:
    """Return the parameter value that changes the signals by about their noise; 0 if none does."""
    best, nearest = 0.0, math.inf
    bare = [problem.simulated(k, values) for k in range(len(problem.recordings))]
    for size in SIZES[SIZES >= least].tolist():
        changes = []
        for k, (signals, noise) in enumerate(zip(bare, problem.noise, strict=True)):
            moved = problem.simulated(k, values, {key: size})
            if signals is None or moved is None:
                return best
            changes.append(float(np.sqrt(np.mean((moved - signals) ** 2))) / noise)
        change = max(changes)
        if change > 0.0 and abs(math.log(change)) < nearest:
            best, nearest = size, abs(math.log(change))
        if change > 100.0:
            break
    return best


def _z(problem: Problem, values: np.ndarray) -> float:
    if any(problem.simulated(k, values) is None for k in range(len(problem.recordings))):
        return math.inf
    return total_z(whiteness_over(problem, values))

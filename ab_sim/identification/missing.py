"""Explanations of residuals that are not noise, each tried once.

Tried are effects that the scene lacks, unknown parameters of a recording, and its sampling rate. A
rotated or late sensor looks like a wrong drive.

If only the speed was recorded, the spindle angle is its integral over time, and the whirl of an
unbalance turns with it. With a wrong sampling rate the two drift apart. With a recorded angle they
do not: suspension and damping absorb the error, and no fit can detect it.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from ab_sim.base.errors import AbSimError
from ab_sim.base.presentation import Progress
from ab_sim.identification.forward import MOTOR
from ab_sim.identification.measured import NUISANCES, Measured
from ab_sim.identification.parameters import FitParameter
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import total_z, whiteness_over
from ab_sim.identification.result import TriedEffect
from ab_sim.identification.stages import Fitted, SearchSettings, StagedFit, minimise
from ab_sim.model.spindle import Ramp, SpeedSchedule
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes, effect_parameters

SIZES = 10.0 ** np.arange(-12.0, 13.0)
"""Candidate sizes of a parameter of unknown magnitude.

The size is chosen at which the signals change by about their noise.
"""
_TRIAL_STEPS = 15
"""Largest number of iterations of the fit with an effect."""
_STEEL = 7800.0
"""Density of steel [kg/m^3], from which an effect gets ball radii that the scene lacks."""
_EQUAL, UNEQUAL = "suspension", "unequal_suspension"
"""Alternative suspensions; a scene has one or the other."""
APART, _TINY = 0.01, 1e-9
"""Initial relative difference of unequal springs, and least initial damping [N s/m]."""
ALIKE = 2.0
"""Difference of sums of squares, in noise variances, below which effects explain equally well."""
_BALLS_ONLY = {
    *("ball_drag", "ball_inertia", "friction_coefficient"),
    *("race_shape", "race_arc", "restitution"),
}
"""Methods of effects that act on balls only."""
LIMIT = 1e3
"""Bound of an effect's parameter, in units of the value that changes the signals noticeably."""
TIME_SCALE = "time_scale"
_MOST_OFF = 0.08
"""Largest relative error of the sampling rate in the search."""
FAST = 0.6
"""Fraction of the top speed above which whirl and angle are compared."""
_PER_TURN = 8
"""Number of trial ratios of whirl to spindle speed within 1 / turns, the width of a peak."""
_MOST_ROWS = 4000
"""Largest number of samples in the comparison of whirl and angle."""
NEAR = 0.7
"""Half-width of the search in units of one over the number of turns."""
STEPS, _POINTS = 15, 16
"""Number of iterations of the fit at each scale, and largest number of scales."""


def tried_effects(
    problem: Problem, values: np.ndarray, free: Sequence[int], white: Sequence[bool], tell: Progress
) -> tuple[TriedEffect, ...]:
    """Try the missing effects and return them, the best explanation first.

    Parameters
    ----------
    problem
        Problem with its noise.
    values
        Fitted values of its parameters [SI].
    free
        Indices of the fitted parameters.
    white
        Whether the residuals are noise, for each recording.
    tell
        Progress callback.
    """
    balls = any(measured.with_balls for measured in problem.recordings)
    names = [
        name
        for name, effect in effect_classes().items()
        if name not in (*problem.scene.effects, MOTOR) and (balls or not _needs_balls(effect))
    ]
    # Iterate the fit without an effect first, so that this gain is not credited to an effect.
    without = minimise(problem, values, free, _TRIAL_STEPS)
    before = _z(problem, without.values)
    trials = []
    for done, name in enumerate(names):
        tell(f"tried with {name}", done, len(names))
        try:
            whole, added = _with_missing(problem, without.values, name)
            trials.append(_tried(problem, without, free, whole, added, name, before))
        except AbSimError as error:
            reason = str(error).splitlines()[0]
            trials.append(TriedEffect(name, 0.0, 0.0, before, {}, reason))
    for number, measured in enumerate(problem.recordings):
        if white[number]:
            continue
        for nuisance in NUISANCES:
            if nuisance not in measured.free:
                name = f"{nuisance} of {measured.name}"
                tell(f"tried with {name}", len(names), len(names))
                freed = replace(measured, free=(*measured.free, nuisance))
                whole = _with_recording(problem, number, freed)
                added = [name for name in whole.names if name not in problem.names]
                trial = _tried(problem, without, free, whole, added, name, before)
                trials.append(trial._replace(nuisance=nuisance))
    count = math.log(sum(measured.count for measured in problem.recordings))
    # Bayesian information criterion (Schwarz, 1978, Ann. Statist. 6, 461-464): an additional
    # parameter must reduce the sum of squares by the logarithm of the number of values.
    return tuple(sorted(trials, key=lambda trial: len(trial.values) * count - trial.drop))


def _needs_balls(effect: type[Any]) -> bool:
    """Return whether an effect acts on balls only: it has no method outside ``_BALLS_ONLY``."""
    methods = {name for name, member in vars(effect).items() if callable(member) and name[0] != "_"}
    return methods - {"check_scene"} <= _BALLS_ONLY


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
    problem: Problem, without: Fitted, free: Sequence[int], whole: Problem, more: Sequence[str],
    name: str, before: float,
) -> TriedEffect:  # fmt: skip
    """Fit a problem with additional parameters, and compare with the fit without these.

    Parameters
    ----------
    problem
        Problem without the additional parameters.
    without
        Fit of ``problem``.
    free
        Indices of the parameters fitted there.
    whole
        Problem with the additional parameters.
    more
        Names of the additional parameters.
    name
        Name of the trial.
    before
        Combined z of the residuals of ``without``.
    """
    values_by_name = dict(zip(problem.names, without.values.tolist(), strict=True))
    begin = np.array(
        [values_by_name.get(parameter.name, parameter.start) for parameter in whole.parameters]
    )
    fitted = {problem.names[j] for j in free} | {*more}
    numbers = [j for j, parameter in enumerate(whole.parameters) if parameter.name in fitted]
    places = [whole.names.index(name) for name in more]
    fits = [minimise(whole, begin, numbers, _TRIAL_STEPS)]
    # The start is just visible, but its sign is unknown, and a minimiser rarely crosses 0.
    if places and begin[places[0]] != 0.0 and whole.parameters[places[0]].low < 0.0:
        begin[places[0]] = -begin[places[0]]
        fits.append(minimise(whole, begin, numbers, _TRIAL_STEPS))
    best = min(fits, key=lambda fit: fit.cost)
    problem.runs += whole.runs
    after, drop = _z(whole, best.values), 2.0 * (without.cost - best.cost)
    if not math.isfinite(after):
        return TriedEffect(name, 0.0, 0.0, after, {}, "every run with it diverges")
    fitted_values = {whole.names[j]: float(best.values[j]) for j in places}
    return TriedEffect(name, _explained(before, after, drop), drop, after, fitted_values)


def _explained(before: float, after: float, drop: float) -> float:
    """Return the fraction of the residuals' z that a trial removes, 0 to 1."""
    if before <= 0.0 or drop <= 0.0:
        return 0.0
    return min(max((before - max(after, 0.0)) / before, 0.0), 1.0)


def _with_missing(problem: Problem, values: np.ndarray, name: str) -> tuple[Problem, list[str]]:
    """Return the problem with an effect added, and the names of the effect's parameters.

    Each parameter starts at a size that changes the signals by about their noise.
    """
    if name == UNEQUAL and _EQUAL in problem.scene.effects:
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
            f"effects.{name}.{field}",
        )
        for field, about in fields.items()
        if (size := _size(other, values, f"effects.{name}.{field}", _least(about)))
    ]  # fmt: skip
    problem.runs += other.runs
    return _with_scene(problem, scene, problem.common, more)


def _unequal(problem: Problem, values: np.ndarray) -> tuple[Problem, list[str]]:
    """Return the problem with unequal springs in place of equal ones, and the new keys to fit."""
    scene = changed_scene(problem.scene, problem.scene_values(values), "fitted")
    equal, rest = scene.effects[_EQUAL], scene.as_mapping()["effects"]
    assert isinstance(rest, dict)
    k, c = equal.stiffness, max(equal.damping, _TINY)
    starts = {
        "stiffness_1": (k * (1 + APART), "N/m"), "stiffness_2": (k * (1 - APART), "N/m"),
        "damping_1": (c, "N s/m"), "damping_2": (c, "N s/m"),
    }  # fmt: skip
    sizes = {name: start for name, (start, _) in starts.items()} | {"axis_angle": 0.5}
    effects = {name: settings for name, settings in rest.items() if name != _EQUAL} | {
        UNEQUAL: sizes
    }
    more = [
        FitParameter(f"effects.{UNEQUAL}.{name}", unit, start, start, 0.0, 10.0 * start,
                  f"effects.{UNEQUAL}.{name}")
        for name, (start, unit) in starts.items()
    ]  # fmt: skip
    axis = f"effects.{UNEQUAL}.axis_angle"
    more.append(FitParameter(axis, "rad", 0.5, 1.0, -3.2, 3.2, axis))
    kept = [
        parameter
        for parameter in problem.common
        if not parameter.name.startswith(f"effects.{_EQUAL}.")
    ]
    springs = changed_scene(problem.scene, {"effects": effects}, f"with {UNEQUAL}")
    return _with_scene(problem, springs, kept, more)


def _with_scene(
    problem: Problem, scene: Scene, kept: Sequence[FitParameter], more: Sequence[FitParameter]
) -> tuple[Problem, list[str]]:
    """Return a problem with another scene, and the names of the parameters in ``more``.

    Its common parameters are ``kept`` and ``more``; recordings and noise are those of ``problem``.
    """
    whole = Problem(scene, (*kept, *more), problem.recordings, problem.noise)
    return whole, [parameter.name for parameter in more]


def _least(about: dict[str, Any]) -> float:
    """Return the lower limit that a parameter's JSON schema states; -inf if there is none."""
    least: float = about.get("minimum", about.get("exclusiveMinimum", -np.inf))
    return least


def _with_effect(scene: Scene, name: str, parameters: dict[str, float]) -> Scene:
    """Return the scene with an effect, and with radii of steel balls if the effect needs them."""
    changes: dict[str, Any] = {f"effects.{name}": parameters}
    if effect_classes()[name].uses_ball_radius and scene.balls.radius is None and scene.balls.count:
        changes["balls.radius"] = [
            (3.0 * mass / (4.0 * math.pi * _STEEL)) ** (1.0 / 3.0) for mass in scene.balls.masses
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
    """Return the combined z of the residuals of all recordings; infinite if a run fails."""
    if any(problem.simulated(k, values) is None for k in range(len(problem.recordings))):
        return math.inf
    return total_z(whiteness_over(problem, values))


def tried_scales(
    problem: Problem,
    values: np.ndarray,
    white: Sequence[bool],
    held: Sequence[int],
    search: SearchSettings,
) -> tuple[TriedEffect, ...]:
    """Try another time scale for each recording whose residuals are not noise.

    Parameters
    ----------
    problem
        Problem with all recordings.
    values
        Fitted values of its parameters [SI].
    white
        Whether the residuals are noise, for each recording.
    held
        Indices of the parameters that stay at their start.
    search
        Settings of the fits.

    Returns
    -------
    tuple[TriedEffect, ...]
        The trials, the best first.
    """
    before, cost = total_z(whiteness_over(problem, values)), problem.cost(values)
    free = [j for j in range(len(problem.parameters)) if j not in held]
    scales = []
    for number, measured in enumerate(problem.recordings):
        # Times in a recording of ab_sim are those of its steps, hence exact.
        if white[number] or measured.angle_known or measured.step is not None:
            continue
        search.tell(f"tried with another sampling rate of {measured.name}", 0, 1)
        about, turns = _drift(measured)
        last = Fitted(values, np.inf)
        # Outside the search range around the present scale, the fitted values are of no use.
        if abs(about) > NEAR / turns:
            whole = _with_scale(problem, number, 1.0 + about)
            last = StagedFit(whole, held, search).run()
            problem.runs += whole.runs
        begin = last.values
        ends: dict[float, Fitted] = {}

        def cost_of(
            share: float, number: int = number, begin: np.ndarray = begin,
            ends: dict[float, Fitted] = ends,
        ) -> float:  # fmt: skip
            # Start from the fit at the nearest scale: the minimum in the ball angles moves with it.
            whole = _with_scale(problem, number, 1.0 + share)
            nearest = min(ends, key=lambda other: abs(other - share), default=None)
            start = begin if nearest is None else ends[nearest].values
            ends[share] = minimise(whole, start, free, STEPS)
            problem.runs += whole.runs
            return ends[share].cost

        reach = NEAR / turns
        minimize_scalar(
            cost_of,
            bounds=(about - reach, about + reach),
            method="bounded",
            options={"maxiter": _POINTS, "xatol": 1e-3 * reach},
        )
        best = min(ends, key=lambda share: ends[share].cost)
        whole = _with_scale(problem, number, 1.0 + best)
        after = total_z(whiteness_over(whole, ends[best].values))
        name, drop = f"time scale of {measured.name}", 2.0 * (cost - ends[best].cost)
        explains = _explained(before, after, drop)
        trial = TriedEffect(name, explains, drop, after, {name: 1.0 + best}, nuisance=TIME_SCALE)
        scales.append(trial)
    return tuple(sorted(scales, key=lambda scale: -scale.drop))


def _drift(measured: Measured) -> tuple[float, float]:
    """Return the relative excess of whirl speed over spindle speed, and the number of turns."""
    there = np.isfinite(measured.signals).all(axis=1)
    time, angle = measured.time[there], measured.spindle_angle[there]
    speed = np.abs(np.gradient(angle, time))
    fast = np.flatnonzero(speed > FAST * speed.max())
    fast = fast[:: max(1, len(fast) // _MOST_ROWS)]
    whirl = (measured.signals[there] @ np.exp(1j * np.array(measured.axes)))[fast]
    turned = angle[fast] - angle[fast[0]]
    turns = max(abs(float(turned[-1])) / (2.0 * np.pi), 1.0)
    # Spectrum of the whirl over the spindle angle instead of time: an unbalance has a sharp peak at
    # the spindle's frequency, also while the speed changes.
    still = (whirl - whirl.mean()) * np.exp(-1j * angle[fast]) * np.hanning(len(fast))
    shares = np.linspace(-_MOST_OFF, _MOST_OFF, 2 * int(_MOST_OFF * turns * _PER_TURN) + 3)
    peaks = [abs(complex(np.sum(still * np.exp(-1j * share * turned)))) for share in shares]
    return float(shares[int(np.argmax(peaks))]), turns


def _with_scale(problem: Problem, number: int, scale: float) -> Problem:
    """Return the problem with the times of a recording multiplied by a factor."""
    return _with_recording(problem, number, scaled(problem.recordings[number], scale))


def _with_recording(problem: Problem, number: int, measured: Measured) -> Problem:
    """Return the problem with another recording at an index."""
    recordings = list(problem.recordings)
    recordings[number] = measured
    return Problem(problem.scene, problem.common, recordings, problem.noise)


def scaled(measured: Measured, scale: float) -> Measured:
    """Return a recording with its times multiplied by a factor, at the same speeds."""
    old = measured.schedule
    pieces = [
        (
            scale * (piece.end - piece.start),
            Ramp(piece.law.speed(0.0), float(piece.law.acceleration(0.0)) / scale),
        )
        for piece in old.segments[:-1]
    ]
    first = old.segments[0]
    schedule = SpeedSchedule(
        pieces, old.segments[-1].law.speed(0.0), scale * first.start, first.start_angle
    )
    return replace(measured, time=scale * measured.time, schedule=schedule)

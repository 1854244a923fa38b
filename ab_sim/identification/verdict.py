"""Verdict on whether a fit explains the measurements, and reasons for the verdict."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.identification.changes import Departure
from ab_sim.identification.measured import BIAS, DELAY, DISC_ANGLE, GAIN, NUISANCES
from ab_sim.identification.missing import TIME_SCALE, UNEQUAL, as_good_as_the_best
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import Whiteness, noises_of
from ab_sim.identification.result import (
    BOUND,
    FITS,
    MISSING,
    NO_BETTER,
    OFF,
    OPEN,
    Identification,
    TriedEffect,
)

_EXPLAINS, _NAMED = 0.7, 0.01
"""Fractions of z that an effect must remove to explain the residuals, and to be named."""
_ABOVE_NOISE, _OF_SIGNALS = 2.0, 0.02
"""Residuals relative to noise and to signals above which the scene does not fit."""
_QUESTIONS = {
    GAIN: "are the signals' unit and the sensor's gain right?",
    BIAS: "has the sensor an offset?",
    DELAY: "is the sensor late?",
    DISC_ANGLE: "is the sensor turned, or the zero of the spindle's angle off?",
    TIME_SCALE: "is the sampling rate, or the speed's unit or calibration, off by that factor? "
    "correct it in the mapping",
}
"""Questions to the user, by the recording's parameter that would explain the residuals."""
_SCALED, _STEADY, PARTS = 0.05, 0.1, 10
"""Tests of a scale factor: least deviation from 1, largest relative variation, number of parts."""


class Misfit(NamedTuple):
    """Deviation of a fitted run from a recording."""

    recording: str
    above_noise: float
    """Root mean square of the residuals relative to the noise."""
    share: float
    """Root mean square of the residuals relative to the signals."""
    factor: float
    """Ratio of measured to fitted signals; 1 if the ratio varies over the recording."""

    @property
    def off(self) -> bool:
        """True if the residuals are well above the noise."""
        return self.above_noise > _ABOVE_NOISE and self.share > _OF_SIGNALS


def misfits_of(
    problem: Problem, values: np.ndarray, whiteness: Sequence[Whiteness]
) -> tuple[Misfit, ...]:
    """Return the deviations of fitted runs from the recordings.

    Parameters
    ----------
    problem
        Fitted problem.
    values
        Values of its parameters [SI].
    whiteness
        Whiteness of each recording's residuals.
    """
    noises = noises_of(problem.recordings)
    misfits = []
    for k, (white, noise) in enumerate(zip(whiteness, noises, strict=True)):
        simulated, measured = problem.simulated(k, values), problem.recordings[k].signals
        factor = 1.0 if simulated is None else _steady_factor(measured, simulated)
        misfits.append(Misfit(white.recording, white.rms / noise, white.share, factor))
    return tuple(misfits)


def _steady_factor(measured: np.ndarray, simulated: np.ndarray) -> float:
    """Return the ratio of two signals (samples, axes) if it is constant over time; otherwise 1."""
    factors = []
    for some, other in zip(
        np.array_split(measured, PARTS), np.array_split(simulated, PARTS), strict=True
    ):
        there = np.isfinite(some)
        square = float(np.sum(other[there] ** 2))
        # A part without vibration has no amplitude to compare.
        if square > 0.01 * float(np.sum(simulated**2)) / PARTS:
            factors.append(float(np.sum(some[there] * other[there])) / square)
    if not factors:
        return 1.0
    middle = float(np.median(factors))
    steady = max(abs(factor - middle) for factor in factors) < _STEADY * abs(middle)
    return middle if steady and abs(middle - 1.0) > _SCALED else 1.0


def verdict_of(
    result: Identification,
    misfits: Sequence[Misfit],
    changes: Sequence[Departure],
    fit: Sequence[str],
) -> tuple[str, list[str]]:
    """Return the verdict of a fit that was not interrupted, and its reasons as sentences.

    Parameters
    ----------
    result
        Identification without a verdict.
    misfits
        Deviation of each recording.
    changes
        Changes during recordings.
    fit
        Keys that were fitted.
    """
    reasons: list[str] = []
    verdict, held_out = FITS, result.held_out
    at_bound = [
        estimate.name
        for estimate in result.estimates
        if estimate.at_bound and not estimate.per_recording
    ]
    for direction in result.knowledge.open:
        verdict = OPEN
        reasons.append(f"{direction.words}; {direction.advice}; held: {direction.held}")
    if held_out is not None:
        reasons.append(
            "a run of the fitted scene on held-out data diverges"
            if np.isinf(held_out.after)
            else f"on held-out data the residuals' r.m.s. is {held_out.after:.3g} of the signals', "
            f"with the scene as it was {held_out.before:.3g}"
        )
        if not held_out.better:
            verdict = NO_BETTER
    if at_bound:
        verdict = BOUND
    for whiteness in result.whiteness:
        reasons += _noise_words(whiteness)
    if not all(whiteness.white for whiteness in result.whiteness):
        off = [misfit for misfit in misfits if misfit.off]
        verdict = OFF if off or at_bound else MISSING
        reasons += [
            f"{misfit.recording}: residuals are {misfit.above_noise:.3g} times the noise, "
            f"{100 * misfit.share:.3g} % of the signals"
            for misfit in off
        ]
        reasons += _effect_words(result.tried, fit)
        reasons += [
            f"{change.recording}: its beginning, fitted alone, fits until {change.time:.3g} s "
            "and not afterwards: did something change or break then, or does the scene lack an "
            "effect that acts only then?"
            for change in changes
        ]
        reasons.append("intervals include random errors only, not the model's error")
    reasons += [
        f"{misfit.recording}: its signals are {misfit.factor:.3g} times the fitted ones all along: "
        "are their unit and the sensor's gain right? (--free gain)"
        for misfit in misfits
        # A change during a recording distorts the scale of other recordings.
        if misfit.factor != 1.0 and not changes
    ]
    reasons += [
        f"{name} is at its bound: are the signals' unit and the sensor's gain right? if so, look "
        "further (--bounds), or at what the scene lacks"
        for name in at_bound
    ]
    return verdict, reasons


def _noise_words(test: Whiteness) -> list[str]:
    """Return sentences on the test of a recording's residuals."""
    name = test.recording
    if not test.judged:
        return [
            f"{name}: too little noise for a test: the residuals are {test.share:.2g} of the "
            "signals"
        ]
    if test.white:
        return [
            f"{name}: the residuals are noise: Ljung-Box z = {test.z:.1f}, "
            f"{100 * test.share:.3g} % of the signals"
        ]
    which = "Ljung-Box z" if test.z >= test.turning_z else "they turn with the spindle, z"
    return [
        f"{name}: the residuals are not noise: {which} = {test.worst:.1f}, more than 4",
        *(f"{name}: {sign}" for sign in test.signs),
    ]


def explained_by(tried: Sequence[TriedEffect]) -> bool:
    """Return whether one of the trials would reduce the residuals to noise, or nearly so."""
    best = next((trial for trial in tried if not trial.failure), None)
    return best is not None and best.explains > _EXPLAINS


def _effect_words(tried: Sequence[TriedEffect], fit: Sequence[str]) -> list[str]:
    """Return sentences on effects that explain the residuals, and on fitting the first of them."""
    best = next((trial for trial in tried if not trial.failure), None)
    if best is None or best.explains < _NAMED:
        return ["no single trial explains the residuals"] if tried else []
    if not explained_by(tried):
        return [
            f"no single trial explains the residuals; the best is {best.name}, "
            f"with z = {best.z:.1f}"
        ]
    names = " or ".join(as_good_as_the_best(tried))
    if best.nuisance:
        values_text = ", ".join(f"{name} = {value:.4g}" for name, value in best.values.items())
        return [
            f"{names} would explain the residuals: with {values_text} z = {best.z:.1f}: "
            + _QUESTIONS[best.nuisance]
            + (f" to fit it: --free {best.nuisance}" if best.nuisance in NUISANCES else "")
        ]
    sets = " ".join(f"--set {key}={value:.4g}" for key, value in best.values.items())
    keys = ",".join([*fit, *best.values])
    # Unequal springs replace the equal ones, which ``--set`` cannot remove.
    can_be_added = best.name != UNEQUAL
    return [
        f"{names} would explain the residuals: with it z = {best.z:.1f}, and the sum of squares "
        f"falls by {best.drop:.4g} noise variances",
        *([f"to fit it: {sets} --fit {keys}"] if can_be_added and best.values else []),
    ]

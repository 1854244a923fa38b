"""Detection of drives or sensors that changed during a recording, by fits of its beginning."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.identification.measured import Measured
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import noises_of, whiteness_over
from ab_sim.identification.stages import SearchSettings, StagedFit, minimise

_BEGINNINGS = (0.75, 0.5, 0.35, 0.25)
"""Fractions of a recording, each from its start, that are fitted in turn until a fit succeeds."""
_WINDOWS, _LOUD = 100, 3.0
"""Number of windows per recording, and r.m.s. of residuals in a window that shows a change.

The r.m.s. is in units of the noise.
"""
_LONGER_STEPS = 15
"""Largest number of iterations of a fit of a longer beginning."""


class Departure(NamedTuple):
    """Recording during which the drive changed: a fit of the beginning does not predict the end."""

    recording: str
    time: float
    """Time up to which the fit holds [s]."""


def changes_in(
    problem: Problem, white: Sequence[bool], held: Sequence[int], search: SearchSettings
) -> tuple[Departure, ...]:
    """Locate changes of drives or sensors during recordings.

    A change spoils the fit of a whole recording. Therefore only its beginning is fitted, together
    with the recordings that fit as a whole. The beginning is extended as long as the prediction
    agrees with the measurement.

    Parameters
    ----------
    problem
        Problem with all recordings.
    white
        Whether the residuals of the whole fit are noise, for each recording.
    held
        Indices of the common parameters that stay at their start.
    search
        Settings of the fits.

    Returns
    -------
    tuple[Departure, ...]
        The changes, at most one per recording.
    """
    good = [measured for k, measured in enumerate(problem.recordings) if white[k]]
    common = [j for j in held if j < len(problem.common)]
    changes = []
    others = [measured for k, measured in enumerate(problem.recordings) if not white[k]]
    # Recordings without balls come first: once accepted, they determine rotor and suspension in the
    # fits of recordings with balls.
    for measured in sorted(others, key=lambda recording: recording.with_balls):
        # A recording without balls may have been spoiled in the joint fit with another one.
        whole = () if measured.with_balls else (1.0,)
        for part in (*whole, *_BEGINNINGS):
            search.tell(f"first {100 * part:.0f} % of {measured.name} alone", 0, 1)
            fit = _part(problem, good, measured, part * measured.duration)
            values = StagedFit(fit, common, search).run().values
            problem.runs += fit.runs
            if whiteness_over(fit, values)[-1].white:
                time = _reach(problem, good, measured, common, values, part * measured.duration)
                if time is None:
                    good.append(measured)
                else:
                    changes.append(Departure(measured.name, time))
                break
    return tuple(changes)


def _part(problem: Problem, good: Sequence[Measured], measured: Measured, until: float) -> Problem:
    """Return the problem of the good recordings and of another one up to a time [s]."""
    some = [*good, measured.until(until)]
    return Problem(problem.scene, problem.common, some, noises_of(some))


def _reach(
    problem: Problem, good: Sequence[Measured], measured: Measured, held: Sequence[int],
    values: np.ndarray, until: float,
) -> float | None:  # fmt: skip
    """Return the time [s] up to which a fit holds, of a beginning until ``until``; None if all.

    The end moves forward only as long as a refit leaves white residuals. Each refit starts from the
    last one, because the fit of a long recording has many local minima in the ball angles.
    """
    beginning = _part(problem, good, measured, until)
    free = [j for j in range(len(values)) if j not in held]
    whole = _part(problem, good, measured, measured.duration)
    while True:
        residuals = whole.whitened_residuals(len(good), values)
        time = _first_deviation(residuals, measured.time, beginning.noise[-1])
        if time is None or time <= until * (1.0 + 1.0 / _WINDOWS):
            return time
        beginning = _part(problem, good, measured, time)
        longer = minimise(beginning, values, free, _LONGER_STEPS).values
        problem.runs += beginning.runs
        if not whiteness_over(beginning, longer)[-1].white:
            return time
        values, until = longer, time


def _first_deviation(residuals: np.ndarray, time: np.ndarray, noise: float) -> float | None:
    """Return the start [s] of the first window with an r.m.s. above ``_LOUD`` times the noise.

    Return None if there is none. Residuals have shape (samples, axes).
    """
    for rows in np.array_split(np.arange(len(time)), _WINDOWS):
        some = residuals[rows]
        there = some[np.isfinite(some)]
        if len(there) and float(np.sqrt(np.mean(there**2))) > _LOUD * noise:
            return float(time[rows[0]])
    return None

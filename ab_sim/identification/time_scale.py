"""Wrong sampling rate as an explanation of residuals.

If only the speed was recorded, the spindle angle is its integral over time, and the whirl of an
unbalance turns with it. With a wrong sampling rate the two drift apart. With a recorded angle they
do not: suspension and damping absorb the error, and no fit can detect it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from ab_sim.base.presentation import Progress
from ab_sim.base.workers import Workers
from ab_sim.identification.measured import Measured
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import total_z, whiteness_over
from ab_sim.identification.result import TriedEffect
from ab_sim.identification.stages import Fitted, StagedFit, minimise
from ab_sim.model.spindle import Ramp, SpeedSchedule

TIME_SCALE = "time_scale"
MOST = 0.08
"""Largest relative error of the sampling rate in the search."""
FAST = 0.6
"""Fraction of the top speed above which whirl and angle are compared."""
PER_TURN = 8
"""Number of trial ratios of whirl to spindle speed within 1 / turns, the width of a peak."""
MOST_ROWS = 4000
NEAR = 0.7
"""Half-width of the search in units of one over the number of turns."""
STEPS, POINTS = 15, 16
"""Number of iterations of the fit at each scale, and largest number of scales."""


def tried_scales(
    problem: Problem, values: np.ndarray, white: Sequence[bool], held: Sequence[int], seed: int,
    tell: Progress, workers: Workers,
) -> tuple[TriedEffect, ...]:  # fmt: skip
    """Try another time scale for each recording whose residuals are not noise.

    Args:
        problem: problem with all recordings.
        values: fitted values of its parameters [SI].
        white: whether the residuals are noise, for each recording.
        held: indices of the parameters that stay at their start.
        seed: seed of the start angles.
        tell: progress callback.
        workers: worker processes for the search.

    Returns:
        The trials, the best first.
    """
    before, cost = total_z(whiteness_over(problem, values)), problem.cost(values)
    free = [j for j in range(len(problem.parameters)) if j not in held]
    scales = []
    for number, measured in enumerate(problem.recordings):
        # Times in a recording of ab_sim are those of its steps, hence exact.
        if white[number] or measured.angle_known or measured.step is not None:
            continue
        tell(f"tried with another sampling rate of {measured.name}", 0, 1)
        about, turns = _drift(measured)
        last = Fitted(values, np.inf)
        if abs(about) > NEAR / turns:
            whole = _with_scale(problem, number, 1.0 + about)
            last = StagedFit(whole, held, seed, tell, workers).run()
            problem.runs += whole.runs
        begin = last.values
        ends: dict[float, Fitted] = {}

        def cost_of(
            share: float, number: int = number, begin: np.ndarray = begin,
            ends: dict[float, Fitted] = ends,
        ) -> float:  # fmt: skip
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
            options={"maxiter": POINTS, "xatol": 1e-3 * reach},
        )
        best = min(ends, key=lambda share: ends[share].cost)
        whole = _with_scale(problem, number, 1.0 + best)
        after = total_z(whiteness_over(whole, ends[best].values))
        name = f"time scale of {measured.name}"
        drop = 2.0 * (cost - ends[best].cost)
        better = before > 0.0 and drop > 0.0
        explains = (before - max(after, 0.0)) / before if better else 0.0
        scales.append(
            TriedEffect(
                name, min(max(explains, 0.0), 1.0), drop, after, {name: 1.0 + best},
                nuisance=TIME_SCALE,
            )
        )  # fmt: skip
    return tuple(sorted(scales, key=lambda scale: -scale.drop))


def _drift(measured: Measured) -> tuple[float, float]:
    """Return the relative excess of whirl speed over spindle speed, and the number of turns."""
    there = np.isfinite(measured.signals).all(axis=1)
    time, angle = measured.time[there], measured.spindle_angle[there]
    speed = np.abs(np.gradient(angle, time))
    fast = np.flatnonzero(speed > FAST * speed.max())
    fast = fast[:: max(1, len(fast) // MOST_ROWS)]
    whirl = (measured.signals[there] @ np.exp(1j * np.array(measured.axes)))[fast]
    turned = angle[fast] - angle[fast[0]]
    turns = max(abs(float(turned[-1])) / (2.0 * np.pi), 1.0)
    still = (whirl - whirl.mean()) * np.exp(-1j * angle[fast]) * np.hanning(len(fast))
    shares = np.linspace(-MOST, MOST, 2 * int(MOST * turns * PER_TURN) + 3)
    peaks = [abs(complex(np.sum(still * np.exp(-1j * share * turned)))) for share in shares]
    return float(shares[int(np.argmax(peaks))]), turns


def _with_scale(problem: Problem, number: int, scale: float) -> Problem:
    recordings = list(problem.recordings)
    recordings[number] = scaled(recordings[number], scale)
    return Problem(problem.scene, problem.common, recordings, problem.noise)


def scaled(measured: Measured, scale: float) -> Measured:
    """Return a recording with its times multiplied by a factor, at the same speeds."""
    old = measured.schedule
    pieces = [
        (
            scale * (piece.end - piece.start),
            Ramp(piece.segment.speed(0.0), float(piece.segment.acceleration(0.0)) / scale),
        )
        for piece in old.segments[:-1]
    ]
    first = old.segments[0]
    schedule = SpeedSchedule(
        pieces, old.segments[-1].segment.speed(0.0), scale * first.start, first.start_angle
    )
    return replace(measured, time=scale * measured.time, schedule=schedule)

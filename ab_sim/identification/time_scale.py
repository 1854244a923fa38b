"""A sampling rate that is off, as an explanation for what a fit leaves.

Where only the speed was recorded, the spindle's angle is its integral over time, and an unbalance's
whirl turns with that. If the sampling rate is off, the two drift apart. With a recorded angle they
do not: suspension and damping take the wrong rate up, and no fit can tell.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from ab_sim.identification.measured import Measured
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import total_z, whiteness_over
from ab_sim.identification.result import TriedEffect
from ab_sim.identification.stages import Fitted, StagedFit, Tell, minimise
from ab_sim.spindle import Ramp, SpeedSchedule
from ab_sim.workers import Workers

TIME_SCALE = "time_scale"
MOST = 0.08
"""By which it is looked for, as a share."""
FAST = 0.6
"""Of the top speed, above which whirl and angle are compared."""
PER_TURN = 8
"""Points per peak of the comparison, which is as narrow as one over the number of turns."""
MOST_ROWS = 4000
NEAR = 0.7
"""Half the width of the search, in units of one over the number of turns."""
STEPS, POINTS = 15, 16
"""Iterations of the fit at each scale, and scales that are looked at, at most."""


def tried_scales(
    problem: Problem, values: np.ndarray, white: Sequence[bool], held: Sequence[int], seed: int,
    tell: Tell, workers: Workers,
) -> tuple[TriedEffect, ...]:  # fmt: skip
    """Try another time scale for each recording that is not explained, the best first.

    Args:
        problem: all recordings.
        values: of its parameters, as fitted [SI].
        white: of each recording: whether its residuals are noise.
        held: numbers of the parameters that stay at their start.
        seed: of the start angles.
        tell: progress.
        workers: share the search.
    """
    before, cost = total_z(whiteness_over(problem, values)), problem.cost(values)
    free = [j for j in range(len(problem.parameters)) if j not in held]
    found = []
    for number, measured in enumerate(problem.recordings):
        # A recording of ab_sim has the times of its steps.
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
        found.append(
            TriedEffect(
                name, min(max(explains, 0.0), 1.0), drop, after, {name: 1.0 + best},
                nuisance=TIME_SCALE,
            )
        )  # fmt: skip
    return tuple(sorted(found, key=lambda each: -each.drop))


def _drift(measured: Measured) -> tuple[float, float]:
    """Return by which share the whirl turns faster than the spindle, and the turns compared."""
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
    """Return a recording whose times are longer by a factor, at the same speeds."""
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

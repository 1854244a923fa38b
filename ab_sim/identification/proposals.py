"""Proposals for the next recording: standard ones, ranked by their information."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import AbSimError
from ab_sim.base.presentation import Progress
from ab_sim.identification.information import beyond, deviations_of
from ab_sim.identification.knowledge import UNKNOWN, shared_numbers
from ab_sim.identification.measured import BIAS, GAIN, Measured
from ab_sim.identification.problem import Problem
from ab_sim.identification.result import Proposal
from ab_sim.model.spindle import Ramp, SpeedSchedule
from ab_sim.scene.load import changed_scene

RAMP, SLOW, HOLD, COAST = 4.0, 16.0, 8.0, 12.0
"""Durations of the standard recordings [s]."""
_ABOVE = 2.0
"""Top speed of standard recordings, relative to the critical speed."""
NEAR = 1.05
"""Speed of the hold, relative to the critical speed."""
TRIAL = 0.05
"""Trial mass, relative to the moving mass."""
_REACH = 1.96
"""Half-width of a 95 % interval in standard deviations."""


class _Standard(NamedTuple):
    """Standard recording: motion of the spindle, and changes of the drive."""

    name: str
    words: str
    """Instructions for the user."""
    pieces: tuple[tuple[float, Ramp], ...]
    """Speed over time: durations [s] and ramps."""
    with_balls: bool = True
    trial_mass: float = 0.0
    """Mass clamped to the deck [kg]."""


def proposals_for(
    problem: Problem,
    values: np.ndarray,
    free: Sequence[int],
    unbounded: Sequence[str],
    tell: Progress,
) -> tuple[Proposal, ...]:
    """Rank standard recordings by newly determined parameters, then by intervals.

    Parameters
    ----------
    problem
        Problem with its noise.
    values
        Fitted values of its parameters [SI].
    free
        Indices of the fitted parameters; other common parameters were fixed and are unknown.
    unbounded
        Names of parameters with unbounded intervals, regardless of the curvature.
    tell
        Progress callback.
    """
    shared, count = shared_numbers(problem), len(problem.common)
    present = _information(problem, values)
    fitted = [k for k in range(count) if k in free]
    lanes = [k for k, j in enumerate(shared) if j in free]
    whole, alone = deviations_of(present), deviations_of(present[:, lanes])
    now = alone[: len(fitted)]
    now[[problem.parameters[k].name in unbounded for k in fitted]] = np.inf
    worst = fitted[int(np.argmax(now))] if fitted else 0
    proposals = []
    standards = _standards(problem, values)
    for done, standard in enumerate(standards):
        tell(f"information of another {standard.name}", done, len(standards))
        try:
            added = _added(problem, values, standard)
        except AbSimError:
            continue
        # Independent recordings add up in J^T J: stack their rows. The gains of the present
        # recordings do not affect the new one.
        both = np.concatenate([present, np.zeros((len(added), len(shared)))])
        both[len(present) :, :count] = added[:, :count]
        then = deviations_of(both)
        opens = [k for k in range(count) if k not in fitted and whole[k] > UNKNOWN >= then[k]]
        deviations = then[[*fitted, *opens]]
        if not opens:
            deviations = deviations_of(both[:, lanes])[: len(fitted)]
        proposals.append(
            Proposal(
                standard.name, standard.words, problem.parameters[worst].name,
                _REACH * float(np.max(now, initial=0.0)),
                _REACH * float(np.max(deviations, initial=0.0)),
                tuple(problem.parameters[k].name for k in opens),
                tuple(_REACH * float(then[k]) for k in opens),
            )
        )  # fmt: skip
    return tuple(
        sorted(proposals, key=lambda proposal: (-len(proposal.opens), proposal.then, proposal.name))
    )


def _information(problem: Problem, values: np.ndarray) -> np.ndarray:
    """Return sensitivities of the common parameters and gains, in units of noise and scales.

    The recordings' own parameters are fitted, which removes their part. Shape (rows, parameters).
    """
    shared = shared_numbers(problem)
    others = [j for j in range(len(problem.parameters)) if j not in shared]
    jacobian = problem.derivatives(values, list(range(len(problem.parameters))))
    return beyond(jacobian[:, others], jacobian[:, shared])


def _standards(problem: Problem, values: np.ndarray) -> list[_Standard]:
    """Return the standard recordings for the fitted drive, within the spindle's limits."""
    scene = changed_scene(problem.scene, problem.scene_values(values), "fitted")
    tops = [measured.schedule.top_speed for measured in problem.recordings]
    critical = scene.critical_speed
    limit = scene.spindle.max_speed
    top = min(max(tops), limit) if critical is None else min(_ABOVE * critical, limit)
    near = 0.5 * top if critical is None else min(NEAR * critical, limit)
    trial = TRIAL * scene.total_mass
    ramp, slow = _ramp(top, RAMP), _ramp(top, SLOW)
    to = f"to {top:.4g} rad/s in"
    standards = [
        _Standard("ramp", f"run up {to} {RAMP:g} s", ramp),
        _Standard("slow ramp", f"run up {to} {SLOW:g} s", slow),
        _Standard(
            "hold", f"run up to {near:.4g} rad/s in 1 s, hold it for {HOLD:g} s",
            (*_ramp(near, 1.0), (HOLD, Ramp(near, 0.0))),
        ),
        _Standard(
            "coast-down", f"from {top:.4g} rad/s, reached in 1 s, down to 0 in {COAST:g} s",
            (*_ramp(top, 1.0), (COAST, Ramp(top, -top / COAST))),
        ),
        _Standard(
            "trial mass", f"clamp {1e3 * trial:.3g} g to the deck, run up {to} {RAMP:g} s",
            ramp, trial_mass=trial,
        ),
    ]  # fmt: skip
    if scene.balls.count:
        words = f"take the balls out, run up {to} {RAMP:g} s"
        standards.append(_Standard("ramp without balls", words, ramp, with_balls=False))
    else:
        standards = [standard._replace(with_balls=False) for standard in standards]
    return standards


def _ramp(top: float, duration: float) -> tuple[tuple[float, Ramp], ...]:
    """Return a run-up from rest to a speed [rad/s] within a duration [s]."""
    return ((duration, Ramp(0.0, top / duration)),)


def _added(problem: Problem, values: np.ndarray, standard: _Standard) -> np.ndarray:
    """Return the sensitivities that a standard recording would add, see ``_information``.

    Sensor, sampling and noise are those of the first recording.
    """
    like = problem.recordings[0]
    duration = sum(length for length, _ in standard.pieces)
    end = standard.pieces[-1]
    between = float(np.median(np.diff(like.time)))
    time = between * np.arange(1, math.floor(duration / between) + 1)
    measured = Measured(
        name=standard.name,
        time=time,
        signals=np.zeros((len(time), len(like.axes))),
        axes=like.axes,
        kind=like.kind,
        schedule=SpeedSchedule(standard.pieces, float(end[1].speed(end[0]))),
        angle_known=True,
        with_balls=standard.with_balls,
        sensor=like.sensor,
        step=like.step,
        delay=like.delay,
        free=tuple(what for what in like.free if what in (GAIN, BIAS)),
        trial_mass=standard.trial_mass,
    )
    other = Problem(problem.scene, problem.common, [measured], [problem.noise[0]])
    begin = other.start
    begin[: len(problem.common)] = values[: len(problem.common)]
    information = _information(other, begin)
    problem.runs += other.runs
    return information

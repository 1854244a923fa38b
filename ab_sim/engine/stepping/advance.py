"""The loops over steps: one for a single run, and one for eight runs side by side.

A method of stepping is a class of records with the functions below. The compiler makes a copy of
the loop for each class, so that the loop's calls are direct.
"""

import math
from typing import Protocol

from ab_sim.base.sample_columns import COMMAND, STEP, TIME
from ab_sim.engine.compiling.kinds import Floats, Table, call
from ab_sim.engine.events.run import Run
from ab_sim.engine.stepping.plan import END, PLACE, EqualSteps, LanePlan, equal_steps
from ab_sim.engine.stepping.side_by_side import LaneSamples


class Method(Protocol):
    """Single run, and the method that takes the run's steps.

    The classes are ``FixedSteps``, ``ImplicitSteps`` and ``TaylorRun``; ``Steps`` of a drive
    chooses one.
    """

    @property
    def run(self) -> Run:
        """Data of the run."""

    def begin(self, steps: EqualSteps, count: int, samples: Table) -> None:
        """Begin ``count`` steps at the present state, in the profile segment of the constants.

        If ``count`` is 0, and ``samples`` has room, record the state without changing anything.
        """

    def take(self, steps: EqualSteps, k: int, sample: Floats) -> bool:
        """Take the k-th step, counted from 0, and record its row.

        Return False if the state left its bounds; it is then in ``run.work.trial``.
        """


def advance(
    method: Method,
    step_plan: Table,
    at: int,
    first: int,
    steps: int,
    command: float,
    samples: Table,
) -> int:
    """Take steps along a step plan, at most to its end, and record each of them.

    With ``steps`` 0, update only the branches of the set-valued laws. If ``samples`` then has room,
    record the present state instead, without changing anything.

    Parameters
    ----------
    method
        The run and its method; the run's arrays change.
    step_plan
        Consecutive step ranges, shape (step ranges, columns as in ``plan``).
    at
        Index of the step range that contains the first step, or the first of its parts.
    first
        Steps taken before.
    steps
        Number of steps to take.
    command
        Requested speed [rad/s]; NaN for that of the profile.
    samples
        Shape (steps, channels), or more lines; columns as in ``fixed_step``.

    Returns
    -------
    int
        Number n of steps taken; -1 - n if the state left its bounds in the next one.
    """
    run = method.run
    only_record = steps == 0 and samples.shape[0] > 0
    done, sound = 0, True
    while sound and at < step_plan.shape[0]:
        line = step_plan[at]
        here = int(min(line[END] - (first + done), float(steps - done)))
        # All parts of a step write the same sample, so that of the last part remains.
        count = max(here, 1) if done < steps else 0
        equal = equal_steps(line, first + done, run.step)
        _enter_segment(run, line, equal, only_record)
        method.begin(equal, count, samples[done : samples.shape[0]])
        taken = 0
        while taken < count and method.take(equal, taken, samples[done + taken]):
            taken += 1
        sound = taken == count
        done += here if sound else taken
        if done == steps:
            break
        at += 1
    _put_labels(run, samples, first if only_record else first + 1, command)
    return done if sound else -1 - done


def _enter_segment(run: Run, line: Floats, steps: EqualSteps, only_record: bool) -> None:
    """Make the profile segment of a step plan's line the active one."""
    memory, smooth = run.work.memory, run.work.smooth
    if steps.start != smooth[0] and not only_record:
        # A method's memory extrapolates a smooth motion: it is not valid after a kink.
        smooth[0] = steps.start
        for i in range(memory.shape[0]):
            for j in range(memory.shape[1]):
                memory[i, j] = 0.0
    for j in range(PLACE, line.size):
        run.scene.c[run.place + j - PLACE] = line[j]
    call(run.scene.prepare, run.scene.c)


def _put_labels(run: Run, samples: Table, first: int, command: float) -> None:
    """Fill in STEP and TIME of samples, the first after ``first`` steps; COMMAND unless NaN."""
    for k in range(samples.shape[0]):
        samples[k, STEP] = float(first + k)
        samples[k, TIME] = (first + k) * run.step
        if not math.isnan(command):
            samples[k, COMMAND] = command


class Lanes(Protocol):
    """Eight runs, one per SIMD lane, and the method that takes the runs' steps.

    The classes are ``LaneRuns``, ``LanesOverEvents`` for scenes with events, and ``TaylorRuns``;
    ``LaneGroup`` of a batch chooses one.
    """

    def enter(self, plan: LanePlan, s: int) -> None:
        """Begin row s of a plan."""

    def take(self, plan: LanePlan, s: int, k: int) -> bool:
        """Take the k-th step of row s, counted from 0; return False if none is left."""

    def record(self, plan: LanePlan, samples: LaneSamples, s: int, k: int) -> None:
        """Record the samples that are due after step k of row s."""


def advance_side_by_side(lanes: Lanes, plan: LanePlan, samples: LaneSamples) -> None:
    """Take the steps of a plan with eight runs; record every ``every``-th.

    Parameters
    ----------
    lanes
        Runs and their method; state and turns are those after the last step at the end.
    plan
        Step plan.
    samples
        Samples of each run; their channels are those of ``fixed_step.record``.
    """
    _touch(samples.numbers)
    for s in range(plan.lines.shape[0]):
        lanes.enter(plan, s)
        k = 0
        while lanes.take(plan, s, k):
            lanes.record(plan, samples, s, k)
            k += 1


_PAGE = 512
"""Doubles per page of memory."""


def _touch(numbers: Floats) -> None:
    """Write to each page of new memory, which the operating system maps at its first use.

    This is done beforehand, because page faults between steps would evict code and numbers of the
    runs from the caches.
    """
    for k in range(0, numbers.size, _PAGE):
        numbers[k] = 0.0

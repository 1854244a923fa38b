"""Times of Taylor steps and samples, and the expressions that update them.

They serve one run and several in lanes. Times of samples are those of ``stepping.plan``, so that
they agree with other methods' to the last bit.
"""

from typing import NamedTuple

from ab_sim.engine.stepping.plan import EqualSteps
from ab_sim.tracing import Expression, Graph, Level, where
from ab_sim.tracing.expression import across
from ab_sim.tracing.functions import ROUND

CLOCK = (
    *("time", "profile_time", "begin", "to", "restart", "end", "until"),
    *("start", "offset", "length", "first", "count", "taken", "due", "next"),
    *("log_tolerance", "shortest", "longest", "step", "ends_steps"),
    *("place", "stride", "every"),
)
"""Names of the lines of the clock; the constants below are their numbers.

Local times, since the profile segment began [s]:

- LOCAL, PROFILE: time of the current sample, and the time at which the profile is evaluated for it.
- BEGIN, END: beginning and end of the Taylor step.
- TO: beginning of the next Taylor step.
- RESTART: 1 if the next step starts from the current sample's state instead of the series, else 0.
- UNTIL: end of the profile segment.

Step range:

- START: beginning of its segment, from the start of the run [s].
- OFFSET: offset of the range within its nominal step [s].
- LENGTH: length of each step [s].
- FIRST, COUNT, TAKEN: steps taken before the range; number of its steps; steps of it taken.
- DUE: 1 if a sample is due in the current Taylor step, else 0.
- NEXT: time of the next sample [s].

Run:

- LOG_TOLERANCE: base-2 logarithm of the tolerance.
- SHORTEST, LONGEST: shortest step at any error, and longest step [s].
- STEP: the scene's step [s].
- ENDS_STEPS: 0 while a part of a step is taken that another part follows, else 1.

Memory of the samples:

- WHERE: index of the run's first sample, in numbers.
- STRIDE: stride between samples, in numbers.
- EVERY: steps from one recorded sample to the next.
"""
INPUTS = (*CLOCK[:2], *(f"clock.{name}" for name in CLOCK[2:]))
"""Names of the lines as inputs. The equations use the first two. The others have a prefix, because
all functions of a kind of scene share one graph, in which e.g. ``until`` is taken."""
LOCAL, PROFILE, BEGIN, TO, RESTART, END, UNTIL = range(7)
START, OFFSET, LENGTH, FIRST, COUNT, TAKEN, _DUE, NEXT = range(7, 15)
LOG_TOLERANCE, SHORTEST, LONGEST, STEP, ENDS_STEPS, WHERE, STRIDE, EVERY = range(15, 23)
SOUND, SOUND_STEPS, COUNT_DUE, COUNT_LEFT = range(4)
STATUS_LINES = 4
"""Number of lines of ``status``:

- SOUND: 1 if a run was within its bounds at all samples, else 0.
- SOUND_STEPS: number of steps for which it was.
- COUNT_DUE: number of runs with a sample due.
- COUNT_LEFT: number of runs with samples left in their ranges.

The last two are equal for all runs."""


class ClockLines:
    """Lines of the clock as expressions.

    Parameters
    ----------
    graph
        Graph that has them as inputs.
    """

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def __getitem__(self, line: int) -> Expression:
        return self._graph.input(INPUTS[line], Level.TIME)

    def flag(self, condition: Expression) -> Expression:
        """Return 1 where a condition holds, else 0."""
        return where(condition, self._graph.constant(1.0), 0.0)


class DueSamples(NamedTuple):
    """Result of ``due_samples``: new clock lines, and numbers of runs with samples due or left."""

    lines: dict[int, Expression]
    """New values of the lines that change."""
    due: Expression
    """Number of runs with a sample due."""
    left: Expression
    """Number of runs that have further samples in their present step ranges."""


def due_samples(clock: ClockLines) -> DueSamples:
    """Mark the runs with a sample in the current step, advance to it, and find the next one.

    A run with samples left, but none due, begins its next step at the end of this one.
    """
    is_left = clock.flag(clock[TAKEN] < clock[COUNT])
    covered = where(clock[NEXT] <= clock[END], 1.0, clock.flag(clock[END] >= clock[UNTIL]))
    due = is_left * covered
    is_due, has_step = due > 0.5, clock[LENGTH] > 0.0
    local, taken = where(is_due, clock[NEXT], clock[LOCAL]), clock[TAKEN] + due
    # ``plan`` has the rule for times, here of expressions.
    range_ = [clock[line] for line in (FIRST, START, OFFSET, LENGTH, UNTIL, STEP)]
    steps = EqualSteps(*range_)  # type: ignore[arg-type]
    here = steps.profile_time(taken)
    # A part of a step is the one step of its range: nothing follows.
    ahead = steps.profile_time(taken + 1.0) + steps.offset
    profile = where(is_due, where(has_step, here, clock[PROFILE]), clock[PROFILE])
    lines = {
        LOCAL: local,
        PROFILE: profile,
        TAKEN: taken,
        _DUE: due,
        NEXT: where(is_due, where(has_step, ahead, local), clock[NEXT]),
        TO: where(is_left - due > 0.5, clock[END], clock[BEGIN]),
    }
    return DueSamples(lines, across(due), across(is_left))


def soundness(
    clock: ClockLines, sound: Expression, steps: Expression, inside: Expression
) -> dict[int, Expression]:
    """Return the new lines of ``status`` at a sample; ``inside`` is 1 within the bounds, else 0."""
    still = where(clock[_DUE] > 0.5, sound * inside, sound)
    return {SOUND: still, SOUND_STEPS: steps + clock[_DUE] * clock[ENDS_STEPS] * still}


def end_of_step(clock: ClockLines, length: Expression) -> Expression:
    """Return the end time of a step of at most ``length`` [s]; for NaN, the segment's end."""
    length = where(length < clock[SHORTEST], clock[SHORTEST], length)
    end = clock[BEGIN] + where(clock[LONGEST] < length, clock[LONGEST], length)
    return where(end < clock[UNTIL], end, clock[UNTIL])


def recorded(clock: ClockLines) -> tuple[Expression, Expression, Expression]:
    """Return 1 if the current sample is recorded, else 0; its place in memory; its step count."""
    steps = clock[FIRST] + clock[TAKEN]
    # Adding and subtracting ROUND rounds to a whole number, in lanes without a function call.
    which = (steps / clock[EVERY] + ROUND) - ROUND
    is_one = clock[_DUE] * clock.flag(abs(which * clock[EVERY] - steps) < 0.5)
    return is_one, clock[WHERE] + (which - 1.0) * clock[STRIDE], steps

"""When runs take their steps and samples: lines of numbers, and how they change, as expressions.

Of one run as of several in lanes; so all are in step with ``stepping.fixed_step`` to the bit, whose
sums and products these are.
"""

from typing import NamedTuple

from ab_sim.tracing import Expression, Graph, Level, where
from ab_sim.tracing.cosine import ROUND
from ab_sim.tracing.expression import across

CLOCK = (
    *("time", "profile_time", "begin", "to", "anew", "end", "until"),
    *("start", "offset", "length", "first", "count", "taken", "due", "next"),
    *("aim", "shortest", "longest", "step", "ends_steps"),
    *("place", "stride", "every"),
)
"""Names of the lines. Times in s since a piece of the profile began: of the sample at hand, and
where it is on the profile; when the Taylor step at hand began, where the next one is to begin, and
whether it does so anew, at the sample at hand; when that step ends, and the piece of the profile.

Of the step range at hand: when its piece of the profile begins, counted from the run's beginning;
where it begins in its nominal step; how long each of its steps is; how many steps there were
before; how many it has; how many of these have been taken; whether one is due, which it has in the
Taylor step at hand; and when the next one is.

Of the run: base-2 logarithm of the tolerance; the shortest step, however large its error, and the
longest; the scene's [s]. Of the range, too: 0 while a part of a step is taken that another one
follows, else 1. Where samples go, in numbers: the run's first one; from a sample to the next; steps
from one that is recorded to the next."""
INPUTS = (*CLOCK[:2], *(f"clock.{name}" for name in CLOCK[2:]))
"""The same as inputs. The first two are the equations' own. The others have names that no one else
has: all functions of a kind of scene share one graph, in which ``until`` is a place's."""
LOCAL, PROFILE, BEGIN, TO, ANEW, END, UNTIL = range(7)
START, OFFSET, LENGTH, FIRST, COUNT, TAKEN, DUE, NEXT = range(7, 15)
AIM, SHORTEST, LONGEST, STEP, ENDS_STEPS, WHERE, STRIDE, EVERY = range(15, 23)
SOUND, SOUND_STEPS, HOW_MANY_DUE, HOW_MANY_LEFT = range(4)
SAID = 4
"""Lines of what is said: 1 of a run that has been within its bounds at all samples, else 0; how
many steps it was; how many runs have a sample due, and how many have some left in their ranges, the
same for all runs."""


class ClockLines:
    """Lines of the clock as expressions.

    Args:
        graph: that has them.
    """

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def __getitem__(self, line: int) -> Expression:
        return self._graph.input(INPUTS[line], Level.TIME)

    def flag(self, condition: Expression) -> Expression:
        """1 where a condition holds, else 0."""
        return where(condition, self._graph.constant(1.0), 0.0)


class DueSamples(NamedTuple):
    """What ``due_samples`` finds."""

    lines: dict[int, Expression]
    """Lines that change."""
    due: Expression
    left: Expression
    """How many runs have a sample due, and how many have some left."""


def due_samples(clock: ClockLines) -> DueSamples:
    """Mark the runs with a sample in the step at hand, go to it, and say when the next one is.

    Where none is due, though some are left, the next step is to begin where this one ends.
    """
    left = clock.flag(clock[TAKEN] < clock[COUNT])
    covered = where(clock[NEXT] <= clock[END], 1.0, clock.flag(clock[END] >= clock[UNTIL]))
    due = left * covered
    is_due, has_step = due > 0.5, clock[LENGTH] > 0.0
    local, taken = where(is_due, clock[NEXT], clock[LOCAL]), clock[TAKEN] + due
    done = clock[FIRST] + taken
    here = done * clock[STEP] - clock[START]
    # A part of a step is the one step of its range: nothing follows.
    ahead = (done + 1.0) * clock[STEP] - clock[START] + clock[OFFSET]
    profile = where(is_due, where(has_step, here, clock[PROFILE]), clock[PROFILE])
    lines = {
        LOCAL: local,
        PROFILE: profile,
        TAKEN: taken,
        DUE: due,
        NEXT: where(is_due, where(has_step, ahead, local), clock[NEXT]),
        TO: where(left - due > 0.5, clock[END], clock[BEGIN]),
    }
    return DueSamples(lines, across(due), across(left))


def soundness(
    clock: ClockLines, sound: Expression, steps: Expression, inside: Expression
) -> dict[int, Expression]:
    """Lines of what is said that change, where a run is within its bounds at a sample, or not."""
    still = where(clock[DUE] > 0.5, sound * inside, sound)
    return {SOUND: still, SOUND_STEPS: steps + clock[DUE] * clock[ENDS_STEPS] * still}


def end_of_step(clock: ClockLines, length: Expression) -> Expression:
    """When a step ends that may be so long [s]; of what is no number, with the profile's piece."""
    length = where(length < clock[SHORTEST], clock[SHORTEST], length)
    end = clock[BEGIN] + where(clock[LONGEST] < length, clock[LONGEST], length)
    return where(end < clock[UNTIL], end, clock[UNTIL])


def recorded(clock: ClockLines) -> tuple[Expression, Expression, Expression]:
    """Whether the sample at hand is recorded, 1 or 0; where; and after how many steps it is."""
    steps = clock[FIRST] + clock[TAKEN]
    which = (steps / clock[EVERY] + ROUND) - ROUND
    is_one = clock[DUE] * clock.flag(abs(which * clock[EVERY] - steps) < 0.5)
    return is_one, clock[WHERE] + (which - 1.0) * clock[STRIDE], steps

"""Events located within a step: the step is cut where a set-valued law takes another branch.

Between two events the equations are smooth, so a stepper keeps its order if it never steps across
one. A trial step that ends with a negative margin contains an event; its time is found by taking
shorter trial steps, each of full order, until the margin is zero. Shampine, Gladwell and Brankin
(1991), ACM TOMS 17, put it that way, but interpolate; a step here costs a microsecond or two.

None of this depends on a scene. It is compiled once, and reaches the scene's own equations and
steps by their addresses (``dynamics.race.calls``).
"""

import contextlib
import functools
import os
import subprocess
import sys
from collections.abc import Iterator
from math import sqrt

import numba
import numpy as np
from numba.core import types

from ab_sim.dynamics.calling import call_at, compiled_address, value_at
from ab_sim.dynamics.dispatch import APART, INLINED, number_of
from ab_sim.dynamics.race.calls import CALLS, STATE, evaluate, take_step
from ab_sim.dynamics.race.margins import NEVER, ROUNDING, margins
from ab_sim.dynamics.race.race import race_kind
from ab_sim.dynamics.race.settle import settle
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.workspace import workspace_kind

BOUNCES = 60
"""Events per step, and 20 more per ball, after which balls that meet stay together.

After twice as many the rest of the step is not located."""
CLOSE = 1e-13
"""An event's time is known to this part of a step."""
CROSSED = 2.0
"""A margin has been crossed when it is this many times below zero what rounding may make of it.

Branches are chosen at one time that, so a step never begins beyond an event, nor with one."""
NEAR = 0.25
"""A force may fall below zero within a step if less than this part of it is left at an end; what
turns as fast as the spindle changes by an eighth of (w h)^2 between two steps."""
DOUBT = 1e-3
"""Part of a force that a cubic through both ends of a step may be wrong by."""
SHORTLY = 1e-5
"""Part of a step over which the rates of forces are measured."""

RACE, WORK = race_kind(), workspace_kind()
_race_at, _work_at, _calls_at = value_at(RACE), value_at(WORK), value_at(CALLS)
_KINDS = (*(types.int64,) * 3, types.boolean, *(types.float64,) * 3, STATE)


@compiled
def go_on(calls, race, work, only_look, begin, length, end, state):  # type: ignore[no-untyped-def]
    """One step, cut at every event; or only a look at what holds where steps begin.

    Where the spindle's acceleration jumps, or events were too many to locate, what held so far may
    hold no more; elsewhere a look may change nothing, or a run would depend on how it is cut up.

    Args:
        calls, race, work: addresses of a Calls, a Race and a Workspace. Its slopes[0] and room hold
            what the equations say at the state; margin and rate what the margins are, unless this
            is only a look, which finds them.
        only_look: whether no step is taken.
        begin: local time [s].
        length: of the step [s].
        end: the time that the next step begins at, ``begin + length`` but for rounding.
        state: changed at events, as the race's modes are; a step's result is in ``work.trial``.

    Returns:
        Of a step: whether ``ahead``, ``margin_ahead``, ``rate_ahead`` and ``acceleration_ahead`` of
        the workspace hold what they say at its end.
    """
    scene, own, room = _calls_at(calls), _race_at(race), _work_at(work)
    if not only_look:
        return _through(scene, own, room, begin, length, end, state)
    margins(own, state, room.slopes[0], room.margin, room.rounding, room.rate)
    if first_below(room.margin, room.margin, room.rounding) >= 0:
        # A variable, because numba would compile all of it once more for a literal.
        slot = np.int64(-1)
        settle(scene, own, room, begin, state, slot, room.counts[0] < 0)
    return False


call_events = call_at(types.boolean, *_KINDS)
"""``go_on`` by its address; ``(address, arguments)``."""


@functools.cache
def events_address() -> int:
    """Where ``go_on`` is."""
    return compiled_address(go_on, *_KINDS)


@contextlib.contextmanager
def compiling_events() -> Iterator[None]:
    """Meanwhile, compile ``go_on`` in another process, if it is not on disk.

    On a new machine that takes as long as a scene's own equations do, and there is a second core.
    """
    if _KINDS in go_on.overloads or not go_on._cache.lacks(_KINDS):
        yield
        return
    code = f"from {__name__} import events_address; events_address()"
    paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
    other = subprocess.Popen(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": paths},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
        other.wait()
    finally:
        other.kill()
        other.wait()


@numba.njit(**INLINED)
def _through(calls, race, work, begin, length, end, state):  # type: ignore[no-untyped-def]
    trial = work.trial
    bounces = BOUNCES + 20 * number_of(race.number)
    most = 2 * bounces
    now, rest = begin, length
    for count in range(most + 1):
        slot = inlined_trial_step(calls, race, work, now, rest, end, state)
        if not within_bounds(trial, work.bounds):
            return False
        for r in range(number_of(race.all)):
            work.acceleration_ahead[r] = race.room.acceleration[r]
        taken = rest
        if slot < 0:
            slot, taken = lowest_between(calls, race, work, now, rest, end, state)
        if slot < 0:
            return True
        if count == bounces:
            work.counts[1] += 1
        if count == most:
            trial_step(calls, race, work, now, rest, end, state)
            return False
        taken, slot = locate(calls, race, work, now, taken, slot, state)
        if taken > 0.0:
            for j in range(state.size):
                state[j] = trial[j]
        work.counts[0] += 1
        now += taken
        rest -= taken
        settle(calls, race, work, now, state, slot, count >= bounces)
        if rest <= CLOSE * length:
            for j in range(state.size):
                trial[j] = state[j]
            break
    return False


@numba.njit(**INLINED)
def within_bounds(trial, bounds):  # type: ignore[no-untyped-def]
    """Whether the state is finite and sound; written so that a NaN is not."""
    for j in range(trial.size):
        if not abs(trial[j]) < bounds[j]:
            return False
    return True


@numba.njit(**APART)
def trial_step(calls, race, work, now, length, end, state):  # type: ignore[no-untyped-def]
    """Step, and see what the margins are at its end: the slot that is first crossed, or -1."""
    take_step(calls, now, length, state)
    evaluate(calls, end, work.trial, work.ahead)
    margins(race, work.trial, work.ahead, work.margin_ahead, work.rounding, work.rate_ahead)
    return first_below(work.margin, work.margin_ahead, work.rounding)


inlined_trial_step = numba.njit(**INLINED)(trial_step.py_func)
"""For every step; at events there is time for calls."""


@numba.njit(**INLINED)
def left(margin, rounding, slot):  # type: ignore[no-untyped-def]
    """How far a margin is from counting as crossed."""
    return margin[slot] + CROSSED * rounding[slot]


@numba.njit(**INLINED)
def first_below(margin, ahead, rounding):  # type: ignore[no-untyped-def]
    """The slot whose margin, drawn as a straight line, is the first to be crossed; -1 if none."""
    found, first = -1, 2.0
    for slot in range(margin.size):
        end = left(ahead, rounding, slot)
        if end < 0.0:
            start = max(left(margin, rounding, slot), 0.0)
            reaches = start / (start - end)
            if reaches < first:
                found, first = slot, reaches
    return found


@numba.njit(**INLINED)
def lowest_between(calls, race, work, now, length, end, state):  # type: ignore[no-untyped-def]
    """A margin that is crossed within the step but not at its end: slot and where, or (-1, ..).

    Margins are drawn as cubics through both ends; only where one falls and rises again is the step
    taken to its lowest point to see. Rates of forces are measured, and only where one could fall so
    far.
    """
    margin, ahead, rounding = work.margin, work.margin_ahead, work.rounding
    measured = False
    for slot in range(margin.size):
        if margin[slot] > 1e200 or ahead[slot] > 1e200:
            continue
        g0, g1 = margin[slot], ahead[slot]
        doubt = 0.0
        r0, r1 = work.rate[slot], work.rate_ahead[slot]
        if r0 >= NEVER:
            size = rounding[slot] / ROUNDING
            if min(g0, g1) > NEAR * size:
                continue
            if not measured:
                measured = True
                brief = SHORTLY * length
                force_rates(calls, race, work, now, brief, state, work.slopes[0], margin, 0)
                force_rates(calls, race, work, end, brief, work.trial, work.ahead, ahead, 1)
            r0, r1 = work.force_rate[0, slot], work.force_rate[1, slot]
            doubt = DOUBT * size
        r0 *= length
        r1 *= length
        if r0 >= 0.0 or r1 <= 0.0:
            continue
        # Cubic g0 + r0 x + p x^2 + q x^3 on 0..1; its minimum is where the derivative rises
        # through zero.
        p = 3.0 * (g1 - g0) - 2.0 * r0 - r1
        q = 2.0 * (g0 - g1) + r0 + r1
        root = p * p - 3.0 * q * r0
        if root < 0.0:
            continue
        x = -r0 / (p + sqrt(root))
        if not 0.0 < x < 1.0 or g0 + x * (r0 + x * (p + x * q)) >= doubt - rounding[slot]:
            continue
        lowest = x * length
        trial_step(calls, race, work, now, lowest, now + lowest, state)
        if left(work.margin_ahead, rounding, slot) < 0.0:
            return slot, lowest
        trial_step(calls, race, work, now, length, end, state)
    return -1, length


@numba.njit(**APART)
def force_rates(calls, race, work, time, shortly, state, slope, margin, line):  # type: ignore[no-untyped-def]
    """Rates of margins at a state, measured ``shortly`` [s] after; into work.force_rate."""
    near = work.near_margin
    for j in range(state.size):
        work.near[0, j] = state[j] + shortly * slope[j]
    evaluate(calls, time + shortly, work.near[0], work.near[1])
    margins(race, work.near[0], work.near[1], near[0], near[1], near[2])
    for slot in range(margin.size):
        work.force_rate[line, slot] = (near[0, slot] - margin[slot]) / shortly


@numba.njit(**APART)
def locate(calls, race, work, now, length, slot, state):  # type: ignore[no-untyped-def]
    """The first event of a step, given that ``slot`` has been crossed at ``length``.

    Returns:
        How far into the step it is [s], with the state there in ``work.trial``, and its slot.
    """
    rounding = work.rounding
    low, high = 0.0, length
    at_low = max(left(work.margin, rounding, slot), 0.0)
    at_high = left(work.margin_ahead, rounding, slot)
    side = 0
    for attempt in range(200):
        x = high
        if high - low > CLOSE * length and attempt < 199:
            # Illinois' regula falsi, with a bisection now and then against a stubborn end. What
            # starts at zero first has to be found where it has risen, for the crossing behind that.
            x = (low * at_high - high * at_low) / (at_high - at_low)
            if low == 0.0 and at_low <= 10.0 * CROSSED * rounding[slot]:
                x = 0.25 * high
            elif attempt % 8 == 7 or not low < x < high:
                x = 0.5 * (low + high)
        trial_step(calls, race, work, now, x, now + x, state)
        if x == high:
            break
        here = left(work.margin_ahead, rounding, slot)
        if here >= 0.0:
            other = other_below(work.margin_ahead, rounding, slot)
            if other < 0:
                low, at_low = x, here
                if side == 1:
                    at_high *= 0.5
                side = 1
                continue
            # Another margin has been crossed before: that one, then. At ``low`` none has been.
            slot, here = other, left(work.margin_ahead, rounding, other)
            at_low = max(left(work.margin, rounding, slot), 0.0) if low == 0.0 else -here
            side = 0
        elif side == -1:
            at_low *= 0.5
        high, at_high, side = x, here, -1
    return high, slot


@numba.njit(**INLINED)
def other_below(ahead, rounding, slot):  # type: ignore[no-untyped-def]
    """A slot other than ``slot`` whose margin has been crossed, or -1."""
    for other in range(ahead.size):
        if other != slot and left(ahead, rounding, other) < 0.0:
            return other
    return -1

"""Events located within a step: the step is cut where a set-valued law takes another branch.

Between two events the equations are smooth, so a stepper keeps its order if it never steps across
one. A trial step that ends with a negative margin contains an event; its time is found by taking
shorter trial steps, each of full order, until the margin is zero. Shampine, Gladwell and Brankin
(1991), ACM TOMS 17, put it that way, but interpolate; a step here costs a microsecond or two.
"""

from math import sqrt

import numba

from ab_sim.dynamics.dispatch import APART, INLINED, chosen_by
from ab_sim.dynamics.planar import derivatives
from ab_sim.dynamics.settle import settle
from ab_sim.dynamics.switches import NEVER, ROUNDING, inlined_margins, margins, motion_rate
from ab_sim.dynamics.system import ball_count, has_events
from ab_sim.integrate.one_step import inlined_derivatives, one_step

BOUNCES = 60
"""Events per step, and 20 more per ball, after which balls that meet stay together.

After twice as many the rest of the step is not located."""
CLOSE = 1e-13
"""An event's time is known to this part of a step."""
DEPTH = 2.0
"""A margin has been crossed when it is this many times below zero what rounding may make of it.

Branches are chosen at one time that, so a step never begins beyond an event, nor with one."""
NEAR = 0.25
"""A force may dip below zero within a step if less than this part of it is left at an end; what
turns as fast as the spindle changes by an eighth of (w h)^2 between two steps."""
DOUBT = 1e-3
"""Part of a force that a cubic through both ends of a step may be wrong by."""
SHORTLY = 1e-5
"""Part of a step over which the rates of forces are measured."""


@numba.njit(**INLINED)
def _plain(system, weights, place, begin, length, end, state, modes, work):  # type: ignore[no-untyped-def]
    one_step(weights, system, place, begin, length, state, modes, work)
    return False, 0.0, 0.0


@numba.njit(**INLINED)
def _with_events(system, weights, place, begin, length, end, state, modes, work):  # type: ignore[no-untyped-def]
    trial = work.trial
    bounces = BOUNCES + 20 * ball_count(system)
    most = 2 * bounces
    now, rest = begin, length
    for count in range(most + 1):
        slot, A1, A2 = trial_step(system, weights, place, now, rest, end, state, modes, work)
        if not within_bounds(trial, work.bounds):
            return False, 0.0, 0.0
        taken = rest
        if slot < 0:
            slot, taken = dip(system, weights, place, now, rest, end, state, modes, work)
        if slot < 0:
            return True, A1, A2
        if count == bounces:
            work.counts[1] += 1
        if count == most:
            trial_step(system, weights, place, now, rest, end, state, modes, work)
            return False, 0.0, 0.0
        taken, slot = locate(system, weights, place, now, taken, slot, state, modes, work)
        if taken > 0.0:
            for j in range(state.size):
                state[j] = trial[j]
        work.counts[0] += 1
        now += taken
        rest -= taken
        settle(system, place, now, state, modes, slot, count >= bounces, work)
        if rest <= CLOSE * length:
            for j in range(state.size):
                trial[j] = state[j]
            break
    return False, 0.0, 0.0


step_over_events = chosen_by(has_events, _with_events, _plain)
"""One step, cut at every event; ``(system, weights, place, begin, length, end, state, modes,
work)``, ``end`` being the time that the next step begins at.

The result is in ``work.trial``. At events state and modes change. Returns whether ``work.ahead``
and ``work.margin_ahead`` hold slope and margins there, and if so the deck's acceleration.
"""


@numba.njit(**INLINED)
def within_bounds(trial, bounds):  # type: ignore[no-untyped-def]
    """Whether the state is finite and sound; written so that a NaN is not."""
    for j in range(trial.size):
        if not abs(trial[j]) < bounds[j]:
            return False
    return True


@numba.njit(**APART)
def trial_step(system, weights, place, now, length, end, state, modes, work):  # type: ignore[no-untyped-def]
    """Step, and look at the margins at its end.

    Returns:
        The slot that is first below zero, or -1; the deck's acceleration at the end.
    """
    one_step(weights, system, place, now, length, state, modes, work)
    A1, A2, al = inlined_derivatives(
        system, place, end, work.trial, modes, work.ahead, work.scratch
    )
    inlined_margins(
        system,
        place,
        end,
        work.trial,
        modes,
        A1,
        A2,
        al,
        work.scratch,
        work.margin_ahead,
        work.grain,
    )
    return first_below(work.margin, work.margin_ahead, work.grain), A1, A2


@numba.njit(**INLINED)
def left(margins, grain, slot):  # type: ignore[no-untyped-def]
    """How far a margin is from counting as crossed."""
    return margins[slot] + DEPTH * grain[slot]


@numba.njit(**INLINED)
def first_below(margin, ahead, grain):  # type: ignore[no-untyped-def]
    """The slot whose margin, drawn as a straight line, is the first to be crossed; -1 if none."""
    found, first = -1, 2.0
    for slot in range(margin.size):
        end = left(ahead, grain, slot)
        if end < 0.0:
            start = max(left(margin, grain, slot), 0.0)
            reaches = start / (start - end)
            if reaches < first:
                found, first = slot, reaches
    return found


@numba.njit(**APART)
def dip(system, weights, place, now, length, end, state, modes, work):  # type: ignore[no-untyped-def]
    """A margin that is crossed within the step but not at its end: slot and where, or (-1, ..).

    Margins are drawn as cubics through both ends; only where one dips is the step taken to its
    lowest point to see. Rates of forces are measured, and only where one could dip.
    """
    margin, ahead, grain = work.margin, work.margin_ahead, work.grain
    measured = False
    for slot in range(margin.size):
        if margin[slot] > 1e200 or ahead[slot] > 1e200:
            continue
        g0, g1 = margin[slot], ahead[slot]
        doubt = 0.0
        r0 = motion_rate(system, state, work.slopes[0], modes, slot)
        if r0 < NEVER:
            r1 = motion_rate(system, work.trial, work.ahead, modes, slot)
        else:
            size = grain[slot] / ROUNDING
            if min(g0, g1) > NEAR * size:
                continue
            if not measured:
                measured = True
                slope, brief = work.slopes[0], SHORTLY * length
                force_rates(system, place, now, brief, state, slope, margin, modes, work, 0)
                slope = work.ahead
                force_rates(system, place, end, brief, work.trial, slope, ahead, modes, work, 1)
            r0, r1 = work.rates[0, slot], work.rates[1, slot]
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
        if not 0.0 < x < 1.0 or g0 + x * (r0 + x * (p + x * q)) >= doubt - grain[slot]:
            continue
        lowest = x * length
        trial_step(system, weights, place, now, lowest, now + lowest, state, modes, work)
        if left(work.margin_ahead, grain, slot) < 0.0:
            return slot, lowest
        trial_step(system, weights, place, now, length, end, state, modes, work)
    return -1, length


@numba.njit(**APART)
def force_rates(system, place, time, shortly, state, slope, margin, modes, work, line):  # type: ignore[no-untyped-def]
    """Rates of margins at a state, measured ``shortly`` [s] after; into work.rates."""
    for j in range(state.size):
        work.near[0, j] = state[j] + shortly * slope[j]
    A1, A2, al = derivatives(
        system, place, time + shortly, work.near[0], modes, work.near[1], work.scratch
    )
    margins(
        system,
        place,
        time + shortly,
        work.near[0],
        modes,
        A1,
        A2,
        al,
        work.scratch,
        work.rates[2],
        work.rates[3],
    )
    for slot in range(margin.size):
        work.rates[line, slot] = (work.rates[2, slot] - margin[slot]) / shortly


@numba.njit(**APART)
def locate(system, weights, place, now, length, slot, state, modes, work):  # type: ignore[no-untyped-def]
    """The first event of a step, given that ``slot`` has been crossed at ``length``.

    Returns:
        How far into the step it is [s], with the state there in ``work.trial``, and its slot.
    """
    grain = work.grain
    low, high = 0.0, length
    at_low = max(left(work.margin, grain, slot), 0.0)
    at_high = left(work.margin_ahead, grain, slot)
    side = 0
    for attempt in range(200):
        x = high
        if high - low > CLOSE * length and attempt < 199:
            # Illinois' regula falsi, with a bisection now and then against a stubborn end. What
            # starts at zero first has to be found where it has risen, for the crossing behind that.
            x = (low * at_high - high * at_low) / (at_high - at_low)
            if low == 0.0 and at_low <= 10.0 * DEPTH * grain[slot]:
                x = 0.25 * high
            elif attempt % 8 == 7 or not low < x < high:
                x = 0.5 * (low + high)
        trial_step(system, weights, place, now, x, now + x, state, modes, work)
        if x == high:
            break
        here = left(work.margin_ahead, grain, slot)
        if here >= 0.0:
            other = other_below(work.margin_ahead, grain, slot)
            if other < 0:
                low, at_low = x, here
                if side == 1:
                    at_high *= 0.5
                side = 1
                continue
            # Another margin has been crossed before: that one, then. At ``low`` none has been.
            slot, here = other, left(work.margin_ahead, grain, other)
            at_low = max(left(work.margin, grain, slot), 0.0) if low == 0.0 else -here
            side = 0
        elif side == -1:
            at_low *= 0.5
        high, at_high, side = x, here, -1
    return high, slot


@numba.njit(**INLINED)
def other_below(ahead, grain, slot):  # type: ignore[no-untyped-def]
    """A slot other than ``slot`` whose margin has been crossed, or -1."""
    for other in range(ahead.size):
        if other != slot and left(ahead, grain, other) < 0.0:
            return other
    return -1

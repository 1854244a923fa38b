"""Events within a step, and what parameters change of their times and of what follows.

In the subset of Python that ``ab_sim.compiling`` translates. The event function g(t, y, p) is zero
at the event's time, whatever p: with y' the change at a fixed time and the clock's column dy/dt,
dt/dp = -(g_p + g_y y') / (g_t + g_y dy/dt). The rest of the step begins so much later, and is so
much shorter; that is all, and is what a saltation matrix says of a field that jumps (Leine and
Nijmeijer (2004), Dynamics and Bifurcations of Non-Smooth Mechanical Systems, ch. 7).
"""

from ab_sim.dynamics.system import JOINED
from ab_sim.events.complementarity import solve_complementarity
from ab_sim.events.event_functions import MOTOR, TOUCH
from ab_sim.events.location import (
    BOUNCES,
    CLOSE,
    event_within,
    locate,
    trial_step,
    within_bounds,
)
from ab_sim.stepping.tangent_functions import function_change, put_table_change
from ab_sim.stepping.tangent_impacts import carry_over_impact
from ab_sim.stepping.tangents import Tangents, carry, copy, hold_stuck, of_block

TOGETHER, GRAZED, UNRESOLVED = 1, 2, 3
"""Kinds of ``Tangents.trouble``: several balls come to rest at once, and each of them at a time of
its own if a parameter changes; an event function only touches zero; events too many to locate, or
no branches found. Another one is ``tangent_functions.OVERLAP``."""
AT_ONCE = 1e-6
"""Share of a rate's change that may be left where a ball comes to rest with another."""


def step_over_events_with_tangents(own: Tangents, begin: float, length: float, end: float) -> bool:
    """``location.step_over_events``, and the changes with it.

    Args:
        own: what steps; ``begin`` and ``length`` of its arrays are of this step.
        begin, length, end: as there.

    Returns:
        As there; False, too, where ``trouble`` says why there are no changes.
    """
    run = own.run
    work, state = run.work, run.state
    now, rest, slot = begin, length, -1
    copy(own.length, own.rest)
    for _ in range(BOUNCES + 20 * run.balls.number):
        trial_step(run, now, rest, end)
        if not within_bounds(work.trial, work.bounds):
            return False
        slot, taken = event_within(run, now, rest, end)
        if slot < 0:
            copy(own.rest, own.length)
            carry(own, now, rest)
            return True
        taken, slot = locate(run, now, taken, slot)
        if not carry_to_event(own, now, taken, slot):
            return False
        for j in range(state.size):
            state[j] = work.trial[j]
        work.counts[0] += 1
        now += taken
        rest -= taken
        unresolved = work.counts[1]
        met = is_impact(own, slot)
        if met and not carry_over_impact(own, now, slot - TOUCH * run.balls.number):
            break
        solve_complementarity(run, now, slot, False)
        if work.counts[1] != unresolved:
            break
        if not come_to_rest_alone(own, -1 if met else slot, met):
            return False
        hold_stuck(own)
        if rest <= CLOSE * length:
            copy(own.rest, own.length)
            carry(own, now, 0.0)
            for j in range(state.size):
                work.trial[j] = state[j]
            return False
    own.trouble[0], own.trouble[1] = UNRESOLVED, slot
    return False


def carry_to_event(own: Tangents, now: float, taken: float, slot: int) -> bool:
    """The changes just before an event, of a state that is in ``trial``; and of its time.

    Afterwards ``begin`` and ``rest`` are those of the rest of the step.

    Args:
        own: what steps.
        now, taken: when the part of the step up to the event begins, and its length [s].
        slot: of the event function.

    Returns:
        Whether there are any; else ``trouble`` says why not.
    """
    lanes = own.lanes
    for block in range(own.blocks):
        for lane in range(lanes):
            own.length[block, lane] = 0.0
    carry(own, now, taken)
    for block in range(own.blocks):
        put_table_change(own, own.run.work.trial, now + taken, block)
        for lane in range(lanes):
            own.event_rate[block, lane] = function_change(own, slot, block, lane)
    clock_block, clock_lane = own.clock // lanes, own.clock % lanes
    speed, clock = own.event_rate[clock_block, clock_lane], of_block(own, own.change, clock_block)
    if not speed < 0.0:
        # It falls through zero; what only touches zero has no time that could be followed.
        own.trouble[0], own.trouble[1] = GRAZED, slot
        return False
    for block in range(own.blocks):
        for lane in range(lanes):
            if block == clock_block and lane == clock_lane:
                continue
            later = -own.event_rate[block, lane] / speed
            own.begin[block, lane] += later
            own.rest[block, lane] -= later
            change = of_block(own, own.change, block)
            for j in range(change.shape[0]):
                change[j, lane] += later * clock[j, clock_lane]
    return True


def is_impact(own: Tangents, slot: int) -> bool:
    """Whether a slot is that of two balls apart."""
    balls, n = own.run.balls, own.run.balls.number
    return TOUCH * n <= slot < MOTOR * n and balls.discrete[slot - TOUCH * n, JOINED] == 0


def come_to_rest_alone(own: Tangents, slot: int, met: bool) -> bool:
    """Whether each ball that an event has brought to rest would come to rest just then.

    Balls may do so together, as far as rounding can tell; if a parameter takes them apart, each has
    an event of its own, and one of them is not followed here.

    Args:
        own: what steps; ``trial`` holds the state just before.
        slot: of the event; of a ball's coming to rest, the ball.
        met: whether it was an impact, after which nothing may rest but what anyhow does.
    """
    run = own.run
    clock_block, clock_lane = own.clock // own.lanes, own.clock % own.lanes
    for i in range(run.balls.number):
        j = run.balls.first_rate + i
        if i == slot or run.state[j] != 0.0 or (run.work.trial[j] == 0.0 and not met):
            continue
        speed = abs(of_block(own, own.change, clock_block)[j, clock_lane])
        for block in range(own.blocks):
            change = of_block(own, own.change, block)
            for lane in range(own.lanes):
                if block == clock_block and lane == clock_lane:
                    continue
                left = abs(change[j, lane])
                moved = 0.0 if met else abs(own.begin[block, lane]) * speed
                if left > AT_ONCE * moved:
                    own.trouble[0], own.trouble[1] = TOGETHER, i
                    own.trouble[3] = block * own.lanes + lane
                    return False
                change[j, lane] = 0.0
    return True

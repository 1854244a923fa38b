"""Events within a step, and what parameters change of their times and of what follows.

In the subset of Python that ``ab_sim.compiling`` translates. The event function g(t, y, p) is zero
at the event's time, whatever p: with y' the change at a fixed time and the clock's column dy/dt,
dt/dp = -(g_p + g_y y') / (g_t + g_y dy/dt). The rest of the step begins so much later, and is so
much shorter; that is all, and is what a saltation matrix says of a field that jumps (Leine and
Nijmeijer (2004), Dynamics and Bifurcations of Non-Smooth Mechanical Systems, ch. 7).
"""

from ab_sim.compiling.kinds import Table, call
from ab_sim.events.complementarity import solve_complementarity
from ab_sim.events.event_functions import LOAD, MOTOR, SLIDE, TOUCH
from ab_sim.events.location import (
    BOUNCES,
    CLOSE,
    locate,
    lowest_between,
    trial_step,
    within_bounds,
)
from ab_sim.events.run import (
    COUPLING,
    DIRECTION,
    FRICTION,
    GRIP,
    LOADED,
    PATH_FORCE,
)
from ab_sim.events.run import LOAD as LOAD_LINE
from ab_sim.stepping.tangents import Tangents, carry, hold_stuck

CONTACT, TOGETHER, GRAZED, UNRESOLVED = 1, 2, 3, 4
"""Kinds of ``Tangents.trouble``: balls touch; several come to rest at once, and each of them at a
time of its own if a parameter changes; an event function only touches zero; events too many to
locate, or no branches found."""
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
        slot = trial_step(run, now, rest, end)
        taken = rest
        if not within_bounds(work.trial, work.bounds):
            return False
        if slot < 0:
            slot, taken = lowest_between(run, now, rest, end)
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
        solve_complementarity(run, now, slot, False)
        if work.counts[1] != unresolved:
            break
        if not come_to_rest_alone(own, slot):
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


def copy(of: Table, into: Table) -> None:
    """Copy a table."""
    for i in range(of.shape[0]):
        for j in range(of.shape[1]):
            into[i, j] = of[i, j]


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
    size, lanes, n = own.run.state.size, own.lanes, own.run.balls.number
    if TOUCH * n <= slot < MOTOR * n:
        own.trouble[0], own.trouble[1] = CONTACT, slot - TOUCH * n
        return False
    for block in range(own.blocks):
        for lane in range(lanes):
            own.length[block, lane] = 0.0
    carry(own, now, taken)
    raw = own.constants.shape[0] // own.blocks
    own.time[0], own.time[1] = now + taken, now + taken
    for block in range(own.blocks):
        for j in range(size):
            for lane in range(lanes):
                own.along[j, lane] = own.change[block * size + j, lane]
        for lane in range(lanes):
            own.along[size, lane] = own.begin[block, lane] + own.length[block, lane]
        constants = own.constants[block * raw : (block + 1) * raw]
        yields = own.yields[block * n : (block + 1) * n]
        c, b, time, there = own.c, own.b, own.time, own.run.work.trial
        call(own.change_table, c, b, time, there, own.along, constants, yields, own.at_event)
        for lane in range(lanes):
            own.event_rate[block, lane] = function_change(own, slot, block, lane)
    clock_block, clock_lane = own.clock // lanes, own.clock % lanes
    speed = own.event_rate[clock_block, clock_lane]
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
            for j in range(size):
                moved = later * own.change[clock_block * size + j, clock_lane]
                own.change[block * size + j, lane] += moved
    return True


def function_change(own: Tangents, slot: int, block: int, lane: int) -> float:
    """Of the event function ``slot`` of ``event_functions``, in a column; after its table."""
    balls, n, size = own.run.balls, own.run.balls.number, own.run.state.size
    every = balls.accelerations
    if slot >= MOTOR * n:
        asked, most = own.at_event[every, lane], own.at_event[every + 1, lane]
        limited = balls.discrete[n, DIRECTION]
        if limited != 0:
            return limited * asked - most
        return most + asked if slot == MOTOR * n else most - asked
    kind, i = slot // n, slot % n
    direction = balls.discrete[i, DIRECTION]
    if kind == SLIDE and direction != 0:
        return direction * own.change[block * size + balls.first_rate + i, lane]
    force = normal_force_change(own, i, lane)
    if kind == LOAD:
        return force if balls.discrete[i, LOADED] == 1 else -force
    first = every + 3
    grip = own.at_event[first + GRIP * n + i, lane] * max(balls.force[i], 0.0)
    if balls.force[i] > 0.0:
        grip += balls.table[GRIP, i] * force
    pull = own.at_event[first + PATH_FORCE * n + i, lane]
    pull -= own.at_event[first + FRICTION * n + i, lane] * balls.force[i]
    pull -= balls.table[FRICTION, i] * force
    for r in range(every):
        line = COUPLING + r
        pull += own.at_event[first + line * n + i, lane] * balls.x[r]
        pull += balls.table[line, i] * own.at_event[r, lane]
    return grip + pull if kind == SLIDE else grip - pull


def normal_force_change(own: Tangents, i: int, lane: int) -> float:
    """Of the race's force on ball i [N], see ``reactions.put_normal_forces``."""
    balls, n = own.run.balls, own.run.balls.number
    every, first = balls.accelerations, balls.accelerations + 3
    force = own.at_event[first + LOAD_LINE * n + i, lane]
    for r in range(every):
        line = COUPLING + every + r
        force += own.at_event[first + line * n + i, lane] * balls.x[r]
        force += balls.table[line, i] * own.at_event[r, lane]
    return force


def come_to_rest_alone(own: Tangents, slot: int) -> bool:
    """Whether each ball that an event has brought to rest would come to rest just then.

    Balls may do so together, as far as rounding can tell; if a parameter takes them apart, each has
    an event of its own, and one of them is not followed here.

    Args:
        own: what steps; ``trial`` holds the state just before.
        slot: of the event; of a ball's coming to rest, the ball.
    """
    run, size = own.run, own.run.state.size
    for i in range(run.balls.number):
        j = run.balls.first_rate + i
        if i != slot and run.state[j] == 0.0 and run.work.trial[j] != 0.0:
            speed = abs(own.change[own.clock // own.lanes * size + j, own.clock % own.lanes])
            for block in range(own.blocks):
                for lane in range(own.lanes):
                    if block * own.lanes + lane == own.clock:
                        continue
                    left = abs(own.change[block * size + j, lane])
                    moved = abs(own.begin[block, lane]) * speed
                    if left > AT_ONCE * moved:
                        own.trouble[0], own.trouble[1] = TOGETHER, i
                        return False
                    own.change[block * size + j, lane] = 0.0
    return True

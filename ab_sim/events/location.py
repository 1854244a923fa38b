"""Events located within a step: the step is cut where a set-valued law takes another branch.

Between two events the equations are smooth, so a stepper keeps its order if it never steps across
one. A trial step that ends with a negative event function contains an event; its time is found by
taking shorter trial steps, each of full order, until the function is zero. Shampine, Gladwell and
Brankin (1991), ACM TOMS 17, put it that way, but interpolate; a step here costs a third of a
microsecond or so.
"""

from ab_sim.compiling.kinds import Floats
from ab_sim.events.complementarity import solve_complementarity
from ab_sim.events.cubics import crossing, landing, minimum_of_cubic
from ab_sim.events.event_functions import NEVER, event_functions, look_at_start
from ab_sim.events.reactions import ROUNDING
from ab_sim.events.run import Run, Workspace, evaluate, take_step

BOUNCES = 60
"""Events per step, and 20 more per ball, after which balls that meet stay together.

After twice as many the rest of the step is not located."""
CLOSE = 1e-13
"""An event's time is known to this part of a step."""
BESIDE = 0.3 * CLOSE
"""How far beside where an event is expected it is looked for, part of a step."""
FINE = 0.1
"""The same, where it is more: its function is zero to this part of what rounding may make of it."""
CROSSED = 2.0
"""A function has been crossed when it is this many times below zero what rounding may make of it.

Branches are chosen at one time that, so a step never begins beyond an event, nor with one."""
NEAR = 0.25
"""A force may fall below zero within a step if less than this part of it is left at an end; what
turns as fast as the spindle changes by an eighth of (w h)^2 between two steps."""
DOUBT = 1e-3
"""Part of a force that a cubic through both ends of a step may be wrong by."""
SHORTLY = 1e-5
"""Part of a step over which the rates of forces are measured."""
FORCES = 1.0 / ROUNDING
"""Of what rounding may make of a force that of which it is made."""
ATTEMPTS = 200
"""Trial steps to one event at most."""


def check_branches(run: Run, time: float) -> None:
    """See to the branches where steps begin, right after ``evaluate`` of the state there.

    Where the spindle's acceleration jumps, or events were too many to locate, what held so far may
    hold no more; elsewhere this changes nothing, or a run would depend on how it is cut up.
    """
    work = run.work
    look_at_start(run)
    if first_crossed(work.value, work.value, work.rounding) >= 0:
        solve_complementarity(run, time, -1, False)


def step_over_events(run: Run, begin: float, length: float, end: float) -> bool:
    """One step, cut at every event; its result is in ``trial``.

    Args:
        run: its slope, table and event functions are those of its state, which changes at events,
            as the discrete state does.
        begin: local time [s].
        length: of the step [s].
        end: the time that the next step begins at, ``begin + length`` but for rounding.

    Returns:
        Whether the workspace holds slope and event functions at its end.
    """
    trial_step(run, begin, length, end)
    return cut_at_events(run, begin, length, end)


def cut_at_events(run: Run, begin: float, length: float, end: float) -> bool:
    """The same, after the whole step has been tried."""
    work, state = run.work, run.state
    bounces = BOUNCES + 20 * run.balls.number
    now, rest = begin, length
    for count in range(2 * bounces + 1):
        if count > 0:
            trial_step(run, now, rest, end)
        if not within_bounds(work.trial, work.bounds):
            return False
        slot, taken = event_within(run, now, rest, end)
        if slot < 0:
            return True
        if count == bounces:
            work.counts[1] += 1
        if count == 2 * bounces:
            trial_step(run, now, rest, end)
            return False
        taken, slot = locate(run, now, taken, slot)
        if taken > 0.0:
            for j in range(state.size):
                state[j] = work.trial[j]
        work.counts[0] += 1
        now += taken
        rest -= taken
        solve_complementarity(run, now, slot, count >= bounces)
        if rest <= CLOSE * length:
            for j in range(state.size):
                work.trial[j] = state[j]
            break
    return False


def within_bounds(trial: Floats, bounds: Floats) -> bool:
    """Whether the state is finite and sound; written so that a NaN is not."""
    for j in range(trial.size):
        if not abs(trial[j]) < bounds[j]:
            return False
    return True


def trial_step(run: Run, now: float, length: float, end: float) -> None:
    """Step, and evaluate the event functions at its end."""
    take_step(run, now, length)
    look_at_end(run, end)


def look_at_end(run: Run, end: float) -> None:
    """Evaluate the event functions at the end of a trial step."""
    evaluate(run, end, run.work.trial, run.work.slope_ahead)
    put_functions_at_end(run)


def put_functions_at_end(run: Run) -> None:
    """The event functions at the end of a trial step, right after ``evaluate`` there."""
    work = run.work
    event_functions(
        run.balls, work.trial, work.slope_ahead, work.value_ahead, work.rounding, work.rate_ahead
    )
    work.measured[1] = 0.0


def left(value: Floats, rounding: Floats, slot: int) -> float:
    """How far an event function is from counting as crossed."""
    return value[slot] + CROSSED * rounding[slot]


def first_crossed(value: Floats, ahead: Floats, rounding: Floats) -> int:
    """The slot whose function, drawn as a straight line, is the first to be crossed; -1 if none."""
    found, first = -1, 2.0
    for slot in range(value.size):
        end = left(ahead, rounding, slot)
        if end < 0.0:
            start = max(left(value, rounding, slot), 0.0)
            reaches = start / (start - end)
            if reaches < first:
                found, first = slot, reaches
    return found


def other_crossed(ahead: Floats, rounding: Floats, slot: int) -> int:
    """A slot other than ``slot`` whose function has been crossed, or -1."""
    for other in range(ahead.size):
        if other != slot and left(ahead, rounding, other) < 0.0:
            return other
    return -1


def event_within(run: Run, now: float, length: float, end: float) -> tuple[int, float]:
    """A function that has been crossed in a trial step, and a part of it after which it has been.

    Returns:
        Its slot, -1 if there is none, and how long that part is [s]; ``trial`` is its end.
    """
    work = run.work
    slot = first_crossed(work.value, work.value_ahead, work.rounding)
    if slot >= 0:
        return slot, length
    return lowest_between(run, now, length, end)


def lowest_between(run: Run, now: float, length: float, end: float) -> tuple[int, float]:
    """A function that is crossed within the step but not at its end: slot and where, or (-1, ..).

    Functions are drawn as cubics through both ends; only where one falls and rises again is the
    step taken to its lowest point to see. Rates of forces are measured, and only where one could
    fall so far.
    """
    work = run.work
    slot, part = next_dip(run, now, length, end, 0)
    while slot >= 0:
        trial_step(run, now, part * length, now + part * length)
        if left(work.value_ahead, work.rounding, slot) < 0.0:
            return slot, part * length
        trial_step(run, now, length, end)
        slot, part = next_dip(run, now, length, end, slot + 1)
    return -1, length


def may_have_event(run: Run, now: float, length: float, end: float) -> bool:
    """Whether a step is to be looked at more closely, from what the workspace holds of its ends."""
    work = run.work
    if first_crossed(work.value, work.value_ahead, work.rounding) >= 0:
        return True
    slot, _ = next_dip(run, now, length, end, 0)
    return slot >= 0


def next_dip(run: Run, now: float, length: float, end: float, first: int) -> tuple[int, float]:
    """The first slot, from one on, whose function may dip below zero within a step; where, or -1.

    Measures the rates of forces at both ends where that is called for.
    """
    work = run.work
    for slot in range(first, work.value.size):
        if is_far(work, slot):
            continue
        if work.rate[slot] >= NEVER and work.measured[1] != SHORTLY * length:
            put_rates_at_ends(run, now, length, end)
        part = dip(work, length, slot)
        if part != 0.0:
            return slot, part
    return -1, 0.0


def is_far(work: Workspace, slot: int) -> bool:
    """Whether a function is beyond reach at both ends of a step, or cannot reach zero at all."""
    value, ahead = work.value[slot], work.value_ahead[slot]
    if value > 1e200 or ahead > 1e200:
        return True
    if work.rate[slot] < NEVER:
        return False
    return min(value, ahead) > NEAR * FORCES * work.rounding[slot]


def dip(work: Workspace, length: float, slot: int) -> float:
    """The part of a step after which a function may be below zero though its ends are not; or 0."""
    is_force, rounding = work.rate[slot] >= NEVER, work.rounding[slot]
    change = (work.force_rate[0, slot] if is_force else work.rate[slot]) * length
    change_ahead = (work.force_rate[1, slot] if is_force else work.rate_ahead[slot]) * length
    part, lowest = minimum_of_cubic(work.value[slot], work.value_ahead[slot], change, change_ahead)
    if part == 0.0:
        return 0.0
    doubt = 0.0
    if is_force:
        # What hardly changes at both ends hardly changes between them.
        doubt = min(DOUBT * FORCES * rounding, abs(change) + abs(change_ahead))
    return 0.0 if lowest >= doubt - rounding else part


def put_rates_at_ends(run: Run, now: float, length: float, end: float) -> None:
    """Rates of the functions at both ends of a step, measured, into ``force_rate``."""
    put_rates_at_start(run, now, length)
    put_rates_at_end(run, end, length)


def put_rates_at_start(run: Run, now: float, length: float) -> None:
    """At its start, unless they have been measured there."""
    work, brief = run.work, SHORTLY * length
    if work.measured[0] != brief:
        put_force_rates(run, now, brief, run.state, work.slope, work.value, 0)


def put_rates_at_end(run: Run, end: float, length: float) -> None:
    """At the end of a trial step."""
    work, brief = run.work, SHORTLY * length
    put_force_rates(run, end, brief, work.trial, work.slope_ahead, work.value_ahead, 1)


def put_force_rates(
    run: Run, time: float, shortly: float, state: Floats, slope: Floats, value: Floats, line: int
) -> None:
    """Rates of the functions at a state, measured ``shortly`` [s] after, into ``force_rate``."""
    work, near, values = run.work, run.work.near, run.work.near_value
    for j in range(state.size):
        near[0, j] = state[j] + shortly * slope[j]
    evaluate(run, time + shortly, near[0], near[1])
    event_functions(run.balls, near[0], near[1], values[0], values[1], values[2])
    for slot in range(value.size):
        work.force_rate[line, slot] = (values[0, slot] - value[slot]) / shortly
    work.measured[line] = shortly


def locate(run: Run, now: float, length: float, slot: int) -> tuple[float, int]:
    """The first event of a step, given that ``slot`` has been crossed at ``length``.

    Returns:
        How far into the step it is [s], with the state there in ``trial``, and its slot.
    """
    work, rounding, start = run.work, run.work.rounding, run.work.value
    low, high = 0.0, length
    at_low, at_high = max(left(start, rounding, slot), 0.0), left(work.value_ahead, rounding, slot)
    rate_low, rate_high = (
        rate_at_start(run, now, length, slot),
        rate_at(run, now + high, length, slot),
    )
    beside, rate = BESIDE * length, rate_high
    for attempt in range(ATTEMPTS):
        if high - low <= CLOSE * length:
            break
        x = crossing(low, high, at_low, at_high, rate_low, rate_high) + beside
        if low == 0.0 and at_low <= 10.0 * CROSSED * rounding[slot]:
            # What starts at zero rises first: it is the crossing behind that.
            back = landing(rate_low * high, at_high, rate_high * high)
            x = back * high + beside if back < 1.0 else 0.25 * high
        if attempt % 8 == 7 or not low < x < high:
            x = 0.5 * (low + high)
        trial_step(run, now, x, now + x)
        here = left(work.value_ahead, rounding, slot)
        other = other_crossed(work.value_ahead, rounding, slot)
        if here >= 0.0 and other < 0:
            # If it is still not reached where it was expected, that is rounding: look further.
            beside = 8.0 * beside if 0.0 < x - low <= 2.0 * beside else BESIDE * length
            rate = rate_at(run, now + x, length, slot)
            low, at_low, rate_low = x, here, rate
            continue
        # Of several that have been crossed here, one may have been before: look before it.
        beside = BESIDE * length if other < 0 else -BESIDE * length
        if here >= 0.0:
            # Another function has been crossed before: that one, then. At ``low`` none has been.
            slot, here = other, left(work.value_ahead, rounding, other)
            at_low, rate_low = -here, NEVER
            if low == 0.0:
                at_low = max(left(start, rounding, slot), 0.0)
                rate_low = rate_at_start(run, now, length, slot)
        elif other < 0 and -here <= max(-rate * CLOSE * length, FINE * rounding[slot]):
            return x, slot
        rate = rate_at(run, now + x, length, slot)
        high, at_high, rate_high = x, here, rate
    trial_step(run, now, high, now + high)
    return high, slot


def rate_at_start(run: Run, now: float, length: float, slot: int) -> float:
    """Rate of an event function at a step's start."""
    work = run.work
    if work.rate[slot] < NEVER:
        return work.rate[slot]
    put_rates_at_start(run, now, length)
    return work.force_rate[0, slot]


def rate_at(run: Run, time: float, length: float, slot: int) -> float:
    """Rate of an event function at a trial step's end; what was evaluated there is lost by this."""
    work = run.work
    if work.rate_ahead[slot] < NEVER:
        return work.rate_ahead[slot]
    put_rates_at_end(run, time, length)
    return work.force_rate[1, slot]

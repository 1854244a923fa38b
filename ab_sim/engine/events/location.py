"""Locate events within a step, and cut the step there.

Sticking, slipping, contact, lift-off and a motor's limit switch the equations. Between two events
the equations are smooth, so a stepper keeps its order as long as no step crosses one. A trial step
keeps the branches of its start even beyond an event, so event functions pass smoothly through zero.
A trial step over the whole length shows which functions are crossed at its end. If none is, cubics
through both ends show which may dip below zero in between. Further trial steps, each of full order,
then close in on the root. Dips before that root are looked for in the same way. Shampine, Gladwell
and Brankin (1991), ACM TOMS 17, interpolate instead; here a trial step costs only about 0.3 us.

Rounding limits the meaning of "zero". Each event function g comes with a bound eps of its rounding
error, and counts as *crossed* if g < -2 eps. An event is located where g + 2 eps changes its sign.
"""

from ab_sim.engine.compiling.kinds import Floats
from ab_sim.engine.events.balls import ROUNDING
from ab_sim.engine.events.complementarity import solve_complementarity
from ab_sim.engine.events.cubics import crossing, landing, minimum_of_cubic
from ab_sim.engine.events.event_functions import NEVER, evaluate_at_start, event_functions
from ab_sim.engine.events.run import Run, Workspace, evaluate, take_step

MAX_EVENTS = 60
"""Events per step, plus 20 per ball, before a step is counted as unresolved.

Later events of the step are located, but balls that meet no longer bounce. After twice as many
events, the rest of the step is taken with the branches that hold then."""
_TIME_TOLERANCE = 1e-13
"""Tolerance of an event's time, as a fraction of the step."""
_OVERSHOOT = 0.3 * _TIME_TOLERANCE
"""Distance beyond the predicted root at which a trial step ends, as a fraction of the step."""
_VALUE_TOLERANCE = 0.1
"""Tolerance of an event function's value, as a fraction of its rounding error bound.

It applies where the function is so flat that ``_TIME_TOLERANCE`` would require a smaller value."""
_CROSSED = 2.0
"""Number of rounding error bounds below zero at which a function counts as crossed.

A branch is chosen if its function is at least minus one bound. A function evaluated again in the
branch just chosen is therefore not crossed, and no event repeats without motion."""
NEAR = 0.25
"""Force at both ends of a step, as a fraction of the magnitude of its terms, above which it stays
positive in between.

A term that rotates with the spindle deviates from a straight line by at most (w h)^2 / 8 of its
magnitude, which is 0.25 at w h = 1.4."""
DOUBT = 1e-3
"""Assumed bound of the error of a force's cubic interpolant, relative to the magnitude of the
force's terms."""
SHORTLY = 1e-5
"""Time over which rates of forces are measured (forward difference), as a fraction of the step."""
_MAGNITUDE_PER_BOUND = 1.0 / ROUNDING
"""Ratio of the magnitude of a force's terms to the bound of its rounding error."""
_MAX_TRIALS = 200
"""Maximum number of trial steps per event; after them, the end of the bracket is taken."""


def check_branches(run: Run, time: float) -> None:
    """Choose the branches again where steps begin, if a function is crossed there.

    Call it right after ``evaluate`` of the state. The branches so far may be wrong after a jump of
    the spindle's acceleration, or after a step with too many events. In all other cases nothing is
    changed, so that a run does not depend on how it is divided into calls. The change is not
    counted as an event.
    """
    work = run.work
    evaluate_at_start(run)
    if _first_crossed(work.value, work.value, work.rounding) >= 0:
        solve_complementarity(run, time, -1, False)


def step_over_events(run: Run, begin: float, length: float, end: float) -> bool:
    """Take one step, cut at every event; its result is in ``trial``.

    Parameters
    ----------
    run
        Run whose slope, table and event functions are those of its state. State and discrete state
        change at events.
    begin
        Local time at the beginning [s].
    length
        Length of the step [s].
    end
        Local time at which the next step begins, ``begin + length`` up to rounding [s].

    Returns
    -------
    bool
        True if the workspace holds slope and event functions at the step's end. False after an
        event at the end, too many events, or a state out of bounds: the next step then begins with
        ``evaluate`` and ``check_branches``.
    """
    _trial_step(run, begin, length, end)
    return cut_at_events(run, begin, length, end)


def cut_at_events(run: Run, begin: float, length: float, end: float) -> bool:
    """Cut a step at every event, as ``step_over_events``, after a trial of the whole step."""
    work, state = run.work, run.state
    most = MAX_EVENTS + 20 * run.balls.number
    now, rest = begin, length
    for count in range(2 * most + 1):
        if count > 0:
            _trial_step(run, now, rest, end)
        if not within_bounds(work.trial, work.bounds):
            return False
        # ``trial`` is now a step from the last event to the end of the whole step.
        slot, bracket = _event_within(run, now, rest, end)
        if slot < 0:
            return True
        if count == most:
            work.counts[1] += 1
        if count == 2 * most:
            # ``trial`` may be a shorter step, up to a dip.
            _trial_step(run, now, rest, end)
            return False
        slot, taken = _first_event(run, now, bracket, slot)
        for j in range(state.size):
            state[j] = work.trial[j]
        work.counts[0] += 1
        now += taken
        rest -= taken
        solve_complementarity(run, now, slot, count >= most)
        # The event is at the end of the step, within the tolerance of its time: no step is left.
        if rest <= _TIME_TOLERANCE * length:
            for j in range(state.size):
                work.trial[j] = state[j]
            break
    return False


def within_bounds(trial: Floats, bounds: Floats) -> bool:
    """Return whether a state is within its bounds; a NaN is not, hence the negated comparison."""
    for j in range(trial.size):
        if not abs(trial[j]) < bounds[j]:
            return False
    return True


def _trial_step(run: Run, now: float, length: float, end: float) -> None:
    """Take a step into ``trial``, and evaluate the event functions at its end."""
    take_step(run, now, length)
    evaluate_at_end(run, end)


def evaluate_at_end(run: Run, end: float) -> None:
    """Evaluate the event functions at the end of a trial step."""
    evaluate(run, end, run.work.trial, run.work.slope_ahead)
    put_functions_at_end(run)


def put_functions_at_end(run: Run) -> None:
    """Compute the event functions at the end of a trial step, right after ``evaluate`` there."""
    work = run.work
    event_functions(
        run.balls, work.trial, work.slope_ahead, work.value_ahead, work.rounding, work.rate_ahead
    )
    work.measured[1] = 0.0


def _margin(value: Floats, rounding: Floats, slot: int) -> float:
    """Return an event function's value plus two rounding error bounds; negative if crossed."""
    return value[slot] + _CROSSED * rounding[slot]


def _first_crossed(value: Floats, ahead: Floats, rounding: Floats) -> int:
    """Return the slot that is crossed first by linear interpolation, or -1 if none is crossed.

    ``rounding`` belongs to the last evaluation and serves for both ends.
    """
    crossed, first = -1, 2.0
    for slot in range(value.size):
        end = _margin(ahead, rounding, slot)
        if end < 0.0:
            start = max(_margin(value, rounding, slot), 0.0)
            reaches = start / (start - end)
            if reaches < first:
                crossed, first = slot, reaches
    return crossed


def _other_crossed(ahead: Floats, rounding: Floats, slot: int) -> int:
    """Return a slot other than ``slot`` whose function is crossed, or -1."""
    for other in range(ahead.size):
        if other != slot and _margin(ahead, rounding, other) < 0.0:
            return other
    return -1


def _event_within(run: Run, now: float, length: float, end: float) -> tuple[int, float]:
    """Return a function that is crossed in a trial step, and a time at which it is crossed.

    Returns
    -------
    tuple[int, float]
        Slot of the function, -1 if there is none, and the time since the step's beginning [s]. The
        state at that time is in ``trial``.
    """
    work = run.work
    slot = _first_crossed(work.value, work.value_ahead, work.rounding)
    if slot >= 0:
        return slot, length
    return _lowest_between(run, now, length, end)


def _lowest_between(run: Run, now: float, length: float, end: float) -> tuple[int, float]:
    """Return a function that is crossed within a step but not at its end.

    Each function is interpolated by a cubic through both ends. If one falls and rises again, a
    trial step to the cubic's minimum shows whether it is crossed there. Rates of forces are not
    known. They are measured only for forces that are small enough to reach zero.

    Returns
    -------
    tuple[int, float]
        Slot of the function, -1 if there is none, and the time since the step's beginning [s].
    """
    work = run.work
    slot, part = _next_hidden_crossing(run, now, length, end, 0)
    while slot >= 0:
        _trial_step(run, now, part * length, now + part * length)
        if _margin(work.value_ahead, work.rounding, slot) < 0.0:
            return slot, part * length
        _trial_step(run, now, length, end)
        slot, part = _next_hidden_crossing(run, now, length, end, slot + 1)
    return -1, length


def may_have_event(run: Run, now: float, length: float, end: float) -> bool:
    """Return whether a step may contain an event, from the event functions at both its ends.

    Steps in lanes (several runs together) are taken without locating events. With contact, this
    test decides which of the runs must take the step again alone, with events located.
    """
    work = run.work
    if _first_crossed(work.value, work.value_ahead, work.rounding) >= 0:
        return True
    slot, _ = _next_hidden_crossing(run, now, length, end, 0)
    return slot >= 0


def _next_hidden_crossing(
    run: Run, now: float, length: float, end: float, first: int
) -> tuple[int, float]:
    """Return the first slot, from ``first`` on, whose function may become negative within a step.

    Rates of forces at both ends are measured if necessary.

    Returns
    -------
    tuple[int, float]
        Slot of the function, or -1, and the position of its minimum as a fraction of the step.
    """
    work = run.work
    for slot in range(first, work.value.size):
        if _is_far(work, slot):
            continue
        if work.rate[slot] >= NEVER and work.measured[1] != SHORTLY * length:
            _put_rates_at_ends(run, now, length, end)
        part = _hidden_crossing(work, length, slot)
        if part != 0.0:
            return slot, part
    return -1, 0.0


def _is_far(work: Workspace, slot: int) -> bool:
    """Return whether a function cannot reach zero within a step, from its values at both ends."""
    value, ahead = work.value[slot], work.value_ahead[slot]
    if value > 1e200 or ahead > 1e200:
        return True
    if work.rate[slot] < NEVER:
        return False
    return min(value, ahead) > NEAR * _MAGNITUDE_PER_BOUND * work.rounding[slot]


def _hidden_crossing(work: Workspace, length: float, slot: int) -> float:
    """Return the fraction of a step at which a function may become negative, or 0 if it cannot."""
    is_force, rounding = work.rate[slot] >= NEVER, work.rounding[slot]
    change = (work.force_rate[0, slot] if is_force else work.rate[slot]) * length
    change_ahead = (work.force_rate[1, slot] if is_force else work.rate_ahead[slot]) * length
    part, lowest = minimum_of_cubic(work.value[slot], work.value_ahead[slot], change, change_ahead)
    if part == 0.0:
        return 0.0
    doubt = 0.0
    if is_force:
        # The interpolant's error is at most of the order of the changes at both ends.
        doubt = min(DOUBT * _MAGNITUDE_PER_BOUND * rounding, abs(change) + abs(change_ahead))
    # One bound, not the two of CROSSED: the trial step at the minimum decides.
    return 0.0 if lowest >= doubt - rounding else part


def _put_rates_at_ends(run: Run, now: float, length: float, end: float) -> None:
    """Measure the rates of the functions at both ends of a step, into ``force_rate``."""
    _put_rates_at_start(run, now, length)
    _put_rates_at_end(run, end, length)


def _put_rates_at_start(run: Run, now: float, length: float) -> None:
    """Measure the rates at a step's start, unless that has been done."""
    work, brief = run.work, SHORTLY * length
    if work.measured[0] != brief:
        put_force_rates(run, now, brief, run.state, work.slope, work.value, 0)


def _put_rates_at_end(run: Run, end: float, length: float) -> None:
    """Measure the rates at the end of a trial step."""
    work, brief = run.work, SHORTLY * length
    put_force_rates(run, end, brief, work.trial, work.slope_ahead, work.value_ahead, 1)


def put_force_rates(
    run: Run, time: float, shortly: float, state: Floats, slope: Floats, value: Floats, line: int
) -> None:
    """Measure the rates of the event functions at a state by a forward difference.

    Parameters
    ----------
    run
        Run whose workspace gets the rates.
    time
        Local time of the state [s].
    shortly
        Time over which the difference is taken [s].
    state
        State, shape (states,).
    slope
        Time derivative of the state.
    value
        Event functions at the state.
    line
        Line of ``force_rate`` to fill in: 0 for a step's start, 1 for its end.
    """
    work, near, values = run.work, run.work.near, run.work.near_value
    for j in range(state.size):
        near[0, j] = state[j] + shortly * slope[j]
    evaluate(run, time + shortly, near[0], near[1])
    event_functions(run.balls, near[0], near[1], values[0], values[1], values[2])
    for slot in range(value.size):
        work.force_rate[line, slot] = (values[0, slot] - value[slot]) / shortly
    work.measured[line] = shortly


def _first_event(run: Run, now: float, length: float, slot: int) -> tuple[int, float]:
    """Return the slot and the time of the first event up to ``length``, as ``locate``.

    A ball may slip and stick again before the event that ``locate`` finds. Its function is not
    crossed at the ends of the trial steps, so dips up to the event are searched, too.
    """
    slot, taken = locate(run, now, length, slot)
    earlier, bracket = _lowest_between(run, now, taken, now + taken)
    while earlier >= 0:
        slot, taken = locate(run, now, bracket, earlier)
        earlier, bracket = _lowest_between(run, now, taken, now + taken)
    if run.work.measured[1] != 0.0:
        # Measured rates have overwritten the results of the evaluation at the event.
        evaluate_at_end(run, now + taken)
    return slot, taken


def locate(run: Run, now: float, length: float, slot: int) -> tuple[int, float]:
    """Return the slot and the time of an event up to ``length``.

    The root is bracketed. A cubic through value and rate at both ends of the bracket predicts it.
    Each trial step ends slightly beyond the prediction, so that the bracket shrinks from both
    sides. Every eighth trial bisects the bracket, which bounds the number of trials. The result is
    a trial just beyond the root, where exactly one function is crossed, or the end of a bracket
    that is shorter than the tolerance. No other function is crossed earlier at a trial's end.

    Parameters
    ----------
    run
        Run whose state and event functions are those at the step's beginning.
    now
        Local time at the step's beginning [s].
    length
        Length of the initial bracket [s].
    slot
        Event function that is crossed at ``length``, where ``trial`` is.

    Returns
    -------
    tuple[int, float]
        Slot, and time since the step's beginning [s], with the state there in ``trial``.
    """
    work, rounding, start = run.work, run.work.rounding, run.work.value
    low, high = 0.0, length
    at_low, at_high = (
        max(_margin(start, rounding, slot), 0.0),
        _margin(work.value_ahead, rounding, slot),
    )
    rate_low, rate_high = (
        _rate_at_start(run, now, length, slot),
        _rate_at(run, now + high, length, slot),
    )
    overshoot, rate = _OVERSHOOT * length, rate_high
    for attempt in range(_MAX_TRIALS):
        if high - low <= _TIME_TOLERANCE * length:
            break
        x = crossing(low, high, at_low, at_high, rate_low, rate_high) + overshoot
        if low == 0.0 and at_low <= 10.0 * _CROSSED * rounding[slot]:
            # The function starts at zero up to rounding. The speed of a ball that has just started
            # to move rises first, so the second root is wanted.
            back = landing(rate_low * high, at_high, rate_high * high)
            x = back * high + overshoot if back < 1.0 else 0.25 * high
        if attempt % 8 == 7 or not low < x < high:
            x = 0.5 * (low + high)
        _trial_step(run, now, x, now + x)
        here = _margin(work.value_ahead, rounding, slot)
        other = _other_crossed(work.value_ahead, rounding, slot)
        if here >= 0.0 and other < 0:
            # No function is crossed yet. If the root was predicted just here, only rounding hides
            # it, so look further ahead, eight times as far each time.
            overshoot = 8.0 * overshoot if 0.0 < x - low <= 2.0 * overshoot else _OVERSHOOT * length
            rate = _rate_at(run, now + x, length, slot)
            low, at_low, rate_low = x, here, rate
            continue
        # If several functions are crossed here, another one may be crossed earlier than this one,
        # so the next trial ends before the predicted root.
        overshoot = _OVERSHOOT * length if other < 0 else -_OVERSHOOT * length
        if here >= 0.0:
            # Another function is crossed first: continue with that one. Its value at ``low`` was
            # not kept, except at the start. Minus its value here makes the next trial bisect.
            slot, here = other, _margin(work.value_ahead, rounding, other)
            at_low, rate_low = -here, NEVER
            if low == 0.0:
                at_low = max(_margin(start, rounding, slot), 0.0)
                rate_low = _rate_at_start(run, now, length, slot)
        # Beyond the root by at most the tolerance of time or of value. The rate is that of the
        # trial before, which saves a measurement.
        elif other < 0 and -here <= max(
            -rate * _TIME_TOLERANCE * length, _VALUE_TOLERANCE * rounding[slot]
        ):
            return slot, x
        rate = _rate_at(run, now + x, length, slot)
        high, at_high, rate_high = x, here, rate
    _trial_step(run, now, high, now + high)
    return slot, high


def _rate_at_start(run: Run, now: float, length: float, slot: int) -> float:
    """Return the rate of event function ``slot`` at a step's start; a force's rate is measured.

    ``now`` is the local time of the start [s], and ``length`` that of the step [s].
    """
    work = run.work
    if work.rate[slot] < NEVER:
        return work.rate[slot]
    _put_rates_at_start(run, now, length)
    return work.force_rate[0, slot]


def _rate_at(run: Run, time: float, length: float, slot: int) -> float:
    """Return the rate of an event function at a trial step's end.

    Measuring a force's rate overwrites the results of the evaluation there.
    """
    work = run.work
    if work.rate_ahead[slot] < NEVER:
        return work.rate_ahead[slot]
    _put_rates_at_end(run, time, length)
    return work.force_rate[1, slot]

"""Collocation on eight Gauss nodes, in spans of its own, the scene's steps being samples in them.

See integrate/span.py for what a span is. How long one is follows from the motion: of the scene's
steps it goes over 1, 2, 3, 4, 6, 8, 12 or 16, or down to a 1024th of one, halved; one that leaves
too large an error, or whose iteration does not come to an end, is made shorter; and after one whose
error is far enough below what is asked the next is longer. Behind a kink of the motion, where there
is no span to carry on, the first one is short beside the spindle's turns and the deck's cycles, as
is fit for what decays after a jump.

Spans follow one another from the last kink on, wherever the samples that are asked for end: a span
belongs to the state, with how many of its samples have been taken. A command in the middle of one
drops the rest of it, and the next begins at the very sample that was the present. No span goes
beyond the end of a piece of the speed profile.

Steps in which a law might take another branch are another stepper's: see integrate/hand_over.py.

Of order 16 at the end of a span where the iterations are carried far enough: Gauss nodes, Hairer,
Norsett, Wanner, Solving Ordinary Differential Equations I, II.7; Hochbruck and Ostermann (2005),
Appl. Numer. Math. 53, 323-339: exponential collocation.
"""

import cmath
from typing import Any, NamedTuple

import numba
import numpy as np

from ab_sim.dynamics.dispatch import APART, INLINED
from ab_sim.dynamics.layout import (
    state_count,
    state_size,
)
from ab_sim.dynamics.numbers.across import total
from ab_sim.dynamics.numbers.lanes import as_lanes, where_less
from ab_sim.dynamics.slope import evaluate, inlined_evaluate
from ab_sim.dynamics.system import Plant, ball_count
from ab_sim.integrate.events import within_bounds
from ab_sim.integrate.fixed_step import (
    Stretch,
    has_turns_to_unwind,
    local_time,
    room_kept,
    unwind,
)
from ab_sim.integrate.hand_over import (
    GOOD,
    PARTS,
    PIECES,
    before_events,
    bounds_within_pieces,
    due,
    given_up,
    hand_over,
    keep_good,
    line_at,
    look,
    reach_of,
)
from ab_sim.integrate.left_out import COEFFICIENTS, last_coefficients
from ab_sim.integrate.on_stack import own_array, own_room
from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.response_tables import (
    LINES_EACH,
    OWN,
    SAMPLES,
    sample_instants,
)
from ab_sim.integrate.responses import NODES, Nodes, gauss, nodes
from ab_sim.integrate.samples import ANGLE, along, record, row_width
from ab_sim.integrate.span import (
    AHEAD,
    AT,
    SHARE,
    STEP,
    TAKEN,
    WAIT,
    begin_anew,
    head_at,
    solve_span,
    states_in_span,
)
from ab_sim.integrate.span_lengths import (
    PATIENCE,
    after_refusal,
    first_size,
    next_size,
    shorter,
    turns_too_far,
)
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.steppers.rk8 import RK8
from ab_sim.integrate.workspace import aligned

LARGEST = 1e300
"""An error [rad] that is taken where there is no choice but that of an iteration without end."""


class Weights(NamedTuple):
    """What a span is made with."""

    nodes: Nodes
    lines: np.ndarray
    """In lanes: see span.AT; shape (10, 8)."""
    tolerance: float
    """rad."""
    steps: float
    """In a span; 0 as many as the tolerance allows."""
    bounds: np.ndarray
    """``hand_over.bounds_within_pieces``."""
    over_events: Any
    """Weights of the stepper that steps with events are handed over to."""
    reach: float
    """Rates times steps at which that one leaves as much of an error."""

    @staticmethod
    def march(run: Any, stretch: Any, rows: Any, steps: int) -> Any:
        """See ``Stepper.weights``."""
        return collocate(run, stretch, rows, steps)


TOLERANCE = Parameter(
    "what each of its spans may leave of an error, in balls' angles and in the deck's displacement "
    "over the race's radius [rad]",
    1e-11,
    1e-16,
    1e-2,
)
STEPS = Parameter(
    "how many of the scene's steps each of its spans goes over, rounded down to 1, 2, 3, 4, 6, 8, "
    "12 or 16, whatever error that leaves; 0 for as many as the tolerance allows",
    0.0,
    0.0,
    float(SAMPLES),
)


def growth_of(z: complex) -> complex:
    """What a step makes of what it solves exactly: drag, and the deck's own motion."""
    return cmath.exp(complex(min(z.real, 0.0), z.imag))


@register_family("collocation", {"tolerance": TOLERANCE, "steps": STEPS})
def collocation(tolerance: float, steps: float) -> Stepper:
    """The method with a tolerance [rad], and a number of steps in a span."""
    own, lines = nodes(sample_instants()), aligned((COEFFICIENTS + NODES, NODES))
    lines[AT], lines[SHARE] = gauss(NODES)
    lines[COEFFICIENTS:] = last_coefficients(lines[AT], lines[SHARE])
    bounds = bounds_within_pieces(lines[AT])
    return Stepper(
        "collocation",
        2 * NODES,
        "Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339, on Gauss nodes",
        Weights(own, lines, tolerance, steps, bounds, RK8.weights, reach_of(tolerance)),
        evaluations=5 * NODES,
        growth=growth_of,
        slopes=RK8.slopes,
        spans=True,
        parts=PARTS,
        tables=LINES_EACH,
        own_motion_at=OWN,
        solves_drag=True,
        over_events=RK8,
        keeps_tolerance=True,
    )


@numba.njit(**INLINED)
def collocate(run, stretch, rows, steps):  # type: ignore[no-untyped-def]
    """See ``fixed_step.step_by_step``."""
    weights, system, state, modes, work = run.weights, run.system, run.state, run.modes, run.work
    place, start, first, length = stretch.place, stretch.start, stretch.first, stretch.length
    nominal, plant = run.step, Plant(system, place, modes, room_kept(system, work))
    head, line = work.memory[head_at(system, state)], work.memory[line_at(system, state)]
    if steps == 0 and rows.shape[0] > 0:
        begin = local_time(run, stretch, 0)
        evaluate(plant, begin, state, work.slopes[0])
        record(plant, along(place, begin), begin, state, rows[0, ANGLE:])
    elif steps == 0 and head[STEP] != length:
        look(plant, run, stretch, rows)
    size, states = state_count(system, state), state_size(system, state)
    width, profile = row_width(system), own_array(0.0, (2, NODES))
    found, numbers = own_array(0.0, (state.size, NODES)), own_array(0.0, (state.size, NODES))
    times, kept = own_array(0.0, (2, NODES)), own_array(0.0, (width, NODES))
    in_span, at, row = as_lanes(found), as_lanes(numbers), as_lanes(kept)
    time, angle_and_speed = as_lanes(times), as_lanes(profile)
    angle_and_speed[0] = angle_and_speed[1] = time[0] = 0.0
    for j in range(states):
        at[j] = 0.0
    slope = own_array(at[0], (size,))
    own = Plant(system, place, modes, own_room(system, ball_count(system), at[0]))
    done, written, write = 0, 0, False
    while written < steps:
        if write or done == steps:
            # Samples of several spans together: eight cost what one does.
            inlined_evaluate(own, time[0], at, slope)
            for lane in range(done - written):
                # Not in lanes: what is asked of the profile at a time has the same digits as
                # elsewhere.
                asked = along(place, (first + written + lane + 1) * nominal - start)
                profile[0, lane], profile[1, lane] = asked
            record(own, (angle_and_speed[0], angle_and_speed[1]), time[0], at, row)
            for lane in range(done - written):
                for j in range(width):
                    rows[written + lane, ANGLE + j] = kept[j, lane]
            written, write = done, False
            continue
        if head[TAKEN] == line[GOOD] or head[STEP] != length:
            now = Stretch(place, start, first + done, stretch.offset, length)
            count = min(due(plant, length, state, work), steps - done)
            anew = count > 0 or head[STEP] != length
            if written < done and (anew or has_turns_to_unwind(system, state)):
                write = True
                continue
            if count > 0:
                taken = hand_over(plant, run, now, rows[done:], count)
                done += taken
                written = done
                if taken < count:
                    return done
                continue
            begin = local_time(run, now, 0)
            unwind(plant, state)
            if anew:
                look(plant, run, now, rows)
            whole = (place.until - begin) / length + 1e-6 if length == nominal else 1.0
            if not take_span(weights, plant, begin, length, whole, state, work):
                if written < done:
                    write = True
                    continue
                if given_up(plant, state, work):
                    continue
                for j in range(states):
                    work.trial[j] = np.nan
                return done
            if line[GOOD] == 0.0:
                continue
        taken = int(head[TAKEN])
        group, lane = taken // NODES, taken % NODES
        until = min(taken + steps - done, int(line[GOOD]), (group + 1) * NODES)
        room = done - written
        if room + until - taken > NODES:
            write = True
            continue
        time[1] = states_in_span(weights, own, group, state, work, in_span)
        if not all_within_bounds(system, in_span, work.bounds):
            for at_lane in range(lane, lane + until - taken):
                for j in range(states):
                    work.trial[j] = found[j, at_lane]
                if not within_bounds(work.trial, work.bounds):
                    until = taken + at_lane - lane
                    steps = done + until - taken
                    break
        count = until - taken
        if room == 0 and lane == 0:
            time[0] = time[1]
            for j in range(states):
                at[j] = in_span[j]
        else:
            for k in range(count):
                times[0, room + k] = times[1, lane + k]
                for j in range(states):
                    numbers[j, room + k] = found[j, lane + k]
        if count > 0:
            for j in range(states):
                state[j] = found[j, lane + count - 1]
        head[TAKEN] = until
        done += count
    return done


@numba.njit(**INLINED)
def all_within_bounds(system, at, bounds):  # type: ignore[no-untyped-def]
    """Whether the states in all lanes are within bounds; written so that a NaN is not."""
    inside = 0.0 * at[0] + 1.0
    for j in range(state_size(system, at)):
        inside = where_less(abs(at[j]), bounds[j], inside, 0.0)
    return total(inside) == NODES


@numba.njit(**INLINED)
def take_span(weights, plant, begin, length, whole, state, work):  # type: ignore[no-untyped-def]
    """The next span, or the spans that make up one step, the last of which stays in memory.

    Args:
        weights: the Weights.
        plant: the Plant.
        begin: local time [s].
        length: of a step [s].
        whole: how many steps there may be in a span, at least one.
        state: the state there, which stays.
        work: the Workspace.

    Returns:
        Whether there is such a span.
    """
    system, head = plant.system, work.memory[head_at(plant.system, state)]
    trial = work.trial
    for j in range(state_size(system, state)):
        trial[j] = state[j]
    if head[STEP] != length:
        size = first_size(weights, plant, begin, length, state, work)
        begin_anew(plant, begin, length * (size / PARTS), state, work)
        head[STEP] = length
    else:
        size = int(head[AHEAD])
    while size > PARTS and size > whole * PARTS:
        size = shorter(size)
    done = 0
    while done < PARTS:
        while turns_too_far(weights, head, length * (size / PARTS)) and size > 1:
            size = shorter(size)
        samples = max(1, size // PARTS)
        allowed = weights.tolerance if size > 1 and weights.steps < 1.0 else LARGEST
        at = begin + (done / PARTS) * length
        share = length * (size / PARTS)
        error, within = solve_span(weights, plant, at, share, samples, allowed, trial, work)
        if error <= allowed:
            done += size
            good = before_events(plant, weights, state, work)
            size = next_size(weights, head, size, error, within)
            head[AHEAD] = size
            if done >= PARTS:
                keep_good(plant.system, good * samples // PIECES, state, work)
            elif good < PIECES:
                keep_good(plant.system, 0, state, work)
                return True
            else:
                go_to_end(weights, plant, state, work)
                while size > (done & -done):
                    size //= 2
        elif size > 1:
            size = after_refusal(weights, size, error)
            head[WAIT] = PATIENCE
        else:
            return False
    return True


@numba.njit(**APART)
def go_to_end(weights, plant, state, work):  # type: ignore[no-untyped-def]
    """The state at the end of a span with one sample into ``work.trial``."""
    numbers = own_array(0.0, (state.size, NODES))
    states_in_span(weights, plant, 0, state, work, as_lanes(numbers))
    for j in range(state_size(plant.system, state)):
        work.trial[j] = numbers[j, 0]

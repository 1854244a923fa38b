"""One iteration of a span of collocation: f at its nodes anew, from what f was a moment before."""

from typing import Any, NamedTuple

import numba

from ab_sim.dynamics.dispatch import INLINED, number_of
from ab_sim.dynamics.layout import (
    integral_at,
    rate_at,
)
from ab_sim.dynamics.ledger import book
from ab_sim.dynamics.numbers.across import product_onto, total
from ab_sim.dynamics.numbers.lanes import as_lanes, zero_in_lanes
from ab_sim.dynamics.system import (
    RACE_CURVATURE,
    accelerate,
    ball_count,
    carrier_coordinates,
    carrier_states,
    carrier_unknowns,
    coordinate_accelerations,
    from_coordinates,
    has_motor,
    only_own_motion,
)
from ab_sim.dynamics.unsolved import be_carried, carry
from ab_sim.integrate.left_out import TINY
from ab_sim.integrate.response_tables import (
    HEAD,
    OWN,
    table_of,
)
from ab_sim.integrate.responses import (
    DAMPING,
    IMPULSE,
    IMPULSE_RATE,
    INTO_PULL,
    INTO_V,
    INTO_X,
    LINES,
    MOST_UNIT,
    NUMBERS,
    STIFFNESS,
    UNIT,
)


class Motion(NamedTuple):
    """At a span's nodes; lanes, each of shape (states,) or more."""

    at: Any
    """States; those of what carries the balls from the last iteration on."""
    slope: Any
    """Room; after an iteration the slope of what is only integrated."""
    force: Any
    """f of each equation."""
    x: Any
    """Of the carrier's equations, and of a motor's."""
    v: Any
    free_x: Any
    """What x would be without f; or, if what carries the balls hangs freely, c v + k x of it."""
    free_v: Any


@numba.njit(**INLINED)
def freely(numbers, table, x, v):  # type: ignore[no-untyped-def]
    """What x and v become without f, as the table there says."""
    tables = as_lanes(numbers)
    k, g = numbers[table + NUMBERS, STIFFNESS], tables[table + IMPULSE]
    return (
        x + (g * v - tables[table + UNIT] * (k * x)),
        tables[table + IMPULSE_RATE] * v - g * (k * x),
    )


@numba.njit(**INLINED)
def response(tables, table, free_x, free_v, force):  # type: ignore[no-untyped-def]
    """x and v, from what they are without f, and f at the nodes."""
    return (
        product_onto(tables, table + INTO_X, force, free_x),
        product_onto(tables, table + INTO_V, force, free_v),
    )


@numba.njit(**INLINED)
def hangs_freely(system):  # type: ignore[no-untyped-def]
    """Whether c v + k x is all that is to be known of what carries the balls.

    A motor's spindle is solved for together with it, and a ledger asks for all states.
    """
    prescribed = not has_motor(system.effects) and number_of(system.ledger) == 0
    return prescribed and only_own_motion(system.carrier, system.effects)


@numba.njit(**INLINED)
def iterate(plant, spindle, axes, motion, first, numbers):  # type: ignore[no-untyped-def]
    """f at the nodes anew: of what carries the balls, these accelerated as before, then of them.

    Args:
        plant: whose table holds the balls' cosines and sines.
        spindle: its motion at the nodes.
        axes: cosine and sine of the rotor's axes on those that stand still.
        motion: the Motion, made anew but for what would be without f.
        first, numbers: the tables.

    Returns:
        How far f of the carrier, and of the others, is from what it was, as angles at the span's
        end; without balls, beside what it is made of. And what makes an angle of the carrier's x,
        and of the spindle's angle.
    """
    at, slope, force, x, v, free_x, free_v = motion
    system, a, tables = plant.system, plant.room.acceleration, as_lanes(numbers)
    carrier, n, ways = system.carrier, ball_count(system), carrier_coordinates(system.carrier)
    own = numbers[OWN:HEAD]
    change = all_of = angles = all_of_angles = zero_in_lanes()
    if hangs_freely(system):
        for j in range(carrier_states(carrier)):
            at[j] = 0.0
    else:
        from_coordinates(carrier, own, axes, x, v, at)
    for i in range(n):
        damping = numbers[first + (ways + i) * LINES + NUMBERS, DAMPING]
        rate = rate_at(system, i)
        slope[rate] = force[ways + i] - damping * at[rate]
    carry(plant, spindle, at, slope)
    coordinate_accelerations(carrier, plant, spindle, own, axes, at, slope)
    for q in range(ways):
        table = first + q * LINES
        damping = numbers[table + NUMBERS, DAMPING]
        stiffness = numbers[table + NUMBERS, STIFFNESS]
        # At rest in its middle it feels no pull, so that f is all there is.
        linear = zero_in_lanes() if hangs_freely(system) else damping * v[q] + stiffness * x[q]
        new = slope[q] + linear
        unit = numbers[table + NUMBERS, MOST_UNIT] if n > 0 else 1.0
        change += abs(new - force[q]) * unit
        force[q] = new
        if hangs_freely(system):
            pull = product_onto(tables, table + INTO_PULL, new, free_x[q])
        else:
            x[q], v[q] = response(tables, table, free_x[q], free_v[q], new)
            pull = damping * v[q] + stiffness * x[q]
        all_of += abs(new) + abs(pull)
        slope[q] = linear - pull
    accelerate(carrier, plant, own, axes, at, slope)
    if has_motor(system.effects):
        q, row = ways + n, carrier_unknowns(carrier)
        table = table_of(plant, first, q)
        damping = numbers[table + NUMBERS, DAMPING]
        linear = damping * v[q]
        new = a[row] + linear
        unit = numbers[table + NUMBERS, MOST_UNIT] if n > 0 else 1.0
        angles += abs(new - force[q]) * unit
        all_of_angles += abs(new) + abs(linear)
        force[q] = new
        x[q], v[q] = response(tables, table, free_x[q], free_v[q], new)
        a[row] += linear - damping * v[q]
        slope[integral_at(system)] = spindle.integral_rate
    be_carried(plant, at, slope)
    book(system.ledger, plant, spindle, at, slope)
    if n == 0:
        scales = 1.0 / (total(all_of) + TINY), 1.0 / (total(all_of_angles) + TINY)
        return total(change) * scales[0], total(angles) * scales[1], scales
    for i in range(n):
        table, rate = first + (ways + i) * LINES + NUMBERS, rate_at(system, i)
        new = slope[rate] + numbers[table, DAMPING] * at[rate]
        angles += abs(new - force[ways + i]) * numbers[table, MOST_UNIT]
        force[ways + i] = new
    scales = system.balls[0, RACE_CURVATURE], 1.0
    return total(change) * scales[0], total(angles), scales

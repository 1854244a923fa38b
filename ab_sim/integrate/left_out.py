"""What a span of collocation leaves out of the motion, by the polynomials that it found."""

import numba

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.numbers.across import total
from ab_sim.dynamics.system import RACE_RADIUS, ball_count, carrier_ways
from ab_sim.integrate.response_tables import place_of, up_to_samples
from ab_sim.integrate.responses import BEYOND, NUMBERS

COEFFICIENTS = 2
"""Of the lines of a stepper's weights the first of four that give the last coefficients of a
polynomial through the nodes by Legendre's, the last first."""
FALLS = 1e-3
"""How fast coefficients are taken to fall at most, from one pair to the next."""
TINY = 1e-300


@numba.njit(**INLINED)
def left_out(system, first, numbers, lines, force):  # type: ignore[no-untyped-def]
    """What f leaves out by being a polynomial, as an error of the span's samples, and within it.

    In the balls' angles, and the deck's displacement over the race's radius; without a ball of f.
    The next coefficients are taken to fall as the last two pairs do. What that does is as exact as
    the tables: at the span's end much less than within, unless the drag is stiff, as Gauss' nodes
    are right there for polynomials of twice the degree.
    """
    n, ways = ball_count(system), carrier_ways(system.carrier)
    samples, error, within = up_to_samples(system, first, 0) - first, 0.0, 0.0
    for q in range(ways + n):
        table = place_of(system, first, q)[0] + NUMBERS
        scale = 1.0 / system.balls[0, RACE_RADIUS] if n > 0 and q < ways else 1.0
        last = abs(total(lines[COEFFICIENTS] * force[q]))
        last += abs(total(lines[COEFFICIENTS + 1] * force[q]))
        before = abs(total(lines[COEFFICIENTS + 2] * force[q]))
        before += abs(total(lines[COEFFICIENTS + 3] * force[q]))
        last *= scale * min(max(last / (before + TINY), FALLS), 1.0)
        error += last * numbers[table + samples, BEYOND] if n > 0 else last
        within += last * numbers[table, BEYOND] if n > 0 else last
    return error, within

"""What a span of collocation leaves out of the motion, by the polynomials that it found."""

import numba

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.layout import equation_count
from ab_sim.dynamics.numbers.across import total
from ab_sim.dynamics.system import ball_count, carrier_coordinates
from ab_sim.integrate.response_tables import table_of, up_to_samples
from ab_sim.integrate.responses import BEYOND, NUMBERS

COEFFICIENTS = 2
"""Of the lines of a stepper's weights the first of four that give the last coefficients of a
polynomial through the nodes by Legendre's, the last first."""
FALLS = 1e-3
"""How fast coefficients are taken to fall at most, from one pair to the next."""
TINY = 1e-300


@numba.njit(**INLINED)
def left_out(plant, first, numbers, lines, force, scales):  # type: ignore[no-untyped-def]
    """What f leaves out by being a polynomial, as an error of the span's samples, and within it.

    In angles, and the deck's displacement over the race's radius; without a ball as a share of f.
    The next coefficients are taken to fall as the last two pairs do. What that does is as exact as
    the tables: at the span's end much less than within, unless the drag is stiff, as Gauss' nodes
    are right there for polynomials of twice the degree. ``scales`` as of ``span.iterate``.
    """
    system, n = plant.system, ball_count(plant.system)
    ways = carrier_coordinates(system.carrier)
    samples, error, within = up_to_samples(system, first, 0) - first, 0.0, 0.0
    for q in range(equation_count(system)):
        table = table_of(plant, first, q) + NUMBERS
        scale = scales[0] if q < ways else 1.0 if q < ways + n else scales[1]
        last = abs(total(lines[COEFFICIENTS] * force[q]))
        last += abs(total(lines[COEFFICIENTS + 1] * force[q]))
        before = abs(total(lines[COEFFICIENTS + 2] * force[q]))
        before += abs(total(lines[COEFFICIENTS + 3] * force[q]))
        last *= scale * min(max(last / (before + TINY), FALLS), 1.0)
        error += last * numbers[table + samples, BEYOND] if n > 0 else last
        within += last * numbers[table, BEYOND] if n > 0 else last
    return error, within

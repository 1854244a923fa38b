"""What a span of collocation leaves out of the motion, by the polynomials that it found."""

import numba
import numpy as np
from numpy.polynomial import legendre

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.layout import equation_count
from ab_sim.dynamics.numbers.across import product
from ab_sim.dynamics.numbers.lanes import as_lanes
from ab_sim.dynamics.system import ball_count, carrier_coordinates
from ab_sim.integrate.on_stack import own_array
from ab_sim.integrate.response_tables import table_of, up_to_samples
from ab_sim.integrate.responses import BEYOND, NODES, NUMBERS

COEFFICIENTS = 2
"""Of the lines of a stepper's weights the first of eight that make of a polynomial's values at the
nodes its last four coefficients by Legendre's, the last first."""
FALLS = 1e-3
"""How fast coefficients are taken to fall at most, from one pair to the next."""
TINY = 1e-300


def last_coefficients(nodes: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """The lines COEFFICIENTS are the first of, shape (8, 8), from the nodes and their weights."""
    found = np.zeros((NODES, NODES))
    for back in range(4):
        power = NODES - 1 - back
        values = legendre.legval(2.0 * nodes - 1.0, [0.0] * power + [1.0])
        found[:, back] = (2 * power + 1) * shares * values
    return found


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
    samples = up_to_samples(system, first, 0) - first
    kept = own_array(0.0, (2, NODES))
    sums = as_lanes(kept)
    sums[0] = sums[1] = 0.0
    for q in range(equation_count(system)):
        table = table_of(plant, first, q) + NUMBERS
        scale = scales[0] if q < ways else 1.0 if q < ways + n else scales[1]
        last = abs(product(lines, COEFFICIENTS, force[q])) * scale
        sums[0] += last * (numbers[table + samples, BEYOND] if n > 0 else 1.0)
        sums[1] += last * (numbers[table, BEYOND] if n > 0 else 1.0)
    return continued(kept, 0), continued(kept, 1)


@numba.njit(**INLINED)
def continued(kept, row):  # type: ignore[no-untyped-def]
    """What comes after the last two pairs of coefficients, if it falls as they do."""
    last, before = kept[row, 0] + kept[row, 1], kept[row, 2] + kept[row, 3]
    return last * min(max(last / (before + TINY), FALLS), 1.0)

"""Tables of the nodes: right to the last bit, so that libraries below do not choose it."""

import hashlib
import math
from fractions import Fraction

import numpy as np
import pytest

from ab_sim.collocation.nodes import (
    PIECES,
    bounds_within_pieces,
    gauss,
    last_coefficients,
    legendre_values,
    nodes,
)


def digest(count: int) -> str:
    made, (at, share) = nodes(count, (1, 2, 4), count), gauss(count)
    tables = (*made, last_coefficients(at, share), bounds_within_pieces(at))
    return hashlib.sha256(b"".join(np.asarray(table).tobytes() for table in tables)).hexdigest()


@pytest.mark.parametrize(
    ("count", "known"), [(5, "e80a1167f8efa032"), (8, "abddff7467ac1e13"), (16, "53accc79fdb8433d")]
)
def test_tables_have_the_bits_that_they_had(count: int, known: str) -> None:
    """With NumPy 2.0 and 2.4, and with OpenBLAS' kernels for Nehalem, Haswell and SkylakeX."""
    assert digest(count)[:16] == known


@pytest.mark.parametrize("count", [5, 16])
def test_bounds_are_those_of_exact_fractions(count: int) -> None:
    """Bernstein's coefficients give the polynomial back, at places of a piece."""
    at = gauss(count)[0]
    roots, found = [Fraction(x) for x in at.tolist()], bounds_within_pieces(at)
    most = count - 1
    for piece in (0, PIECES - 1, PIECES):
        width = Fraction(1, PIECES) if piece < PIECES else Fraction(1)
        begin = piece * width if piece < PIECES else Fraction(0)
        for k in (0, count // 2):
            coefficients = [Fraction(x) for x in found[piece, k].tolist()]
            for z in (Fraction(0), Fraction(1, 3), Fraction(1)):
                x = begin + z * width
                others = [root for root in roots if root != roots[k]]
                exact = math.prod((x - root) / (roots[k] - root) for root in others)
                terms = [
                    math.comb(most, b) * z**b * (1 - z) ** (most - b) * coefficient
                    for b, coefficient in enumerate(coefficients)
                ]
                assert abs(sum(terms) - exact) <= sum(map(abs, terms)) / 2**53


def test_legendre_values_are_those_of_the_polynomials() -> None:
    x = np.linspace(-1.0, 1.0, 7)
    np.testing.assert_allclose(legendre_values(0, x), 1.0)
    np.testing.assert_allclose(legendre_values(1, x), x)
    np.testing.assert_allclose(legendre_values(3, x), 0.5 * (5 * x**3 - 3 * x), atol=1e-15)

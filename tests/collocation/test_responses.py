"""Tables of responses: against matrix exponentials in 40 digits, whatever is stiff."""

import mpmath
import numpy as np
import pytest

from ab_sim.collocation.impulse import SERIES, ImpulseResponse, impulse_response
from ab_sim.collocation.nodes import CollocationNodes, nodes
from ab_sim.collocation.responses import BEYOND, MOST_UNIT, NUMBERS, fill, lines_of_table
from ab_sim.collocation.tables import put_carry
from ab_sim.compiling import Floats, Table, compiled, scratch

LENGTH = 0.02
STIFF = [
    *((0.0, 0.0), (2.0, 1e4), (300.0, 1e4), (200.0, 1e4), (0.0, 9e4), (0.0, 9.9e5), (0.0, 4e6)),
    *((1e-6, 0.0), (714.0, 0.0), (999.0, 0.0), (3e3, 0.0), (7e4, 0.0)),
    *((2000.0, 900.0), (2000.0, 1e-3), (1000.0, 249999.9)),
]
"""Damping [1/s] and stiffness [1/s^2]."""
SAMPLES = (1, 3, 5, 12)


def exact(until: float, c: float, k: float, force: list[mpmath.mpf]) -> tuple[float, float]:
    """x and v from rest after a share of a step, under a force that is a polynomial in that share.

    By the exponential of one matrix, which has the powers of time among its unknowns.
    """
    size, h = 2 + len(force), mpmath.mpf(LENGTH)
    a, begin = mpmath.zeros(size), mpmath.zeros(size, 1)
    a[0, 1], a[1, 0], a[1, 1], a[1, 2] = 1, -mpmath.mpf(k) * h**2, -mpmath.mpf(c) * h, h**2
    for j in range(2, size - 1):
        a[j, j + 1] = 1
    for p, coefficient in enumerate(force):
        begin[2 + p] = coefficient * mpmath.factorial(p)
    end = mpmath.expm(a * mpmath.mpf(until)) * begin
    return float(end[0]), float(end[1] / h)


def with_roots(roots: list[float]) -> list[mpmath.mpf]:
    """Coefficients of a polynomial, that of the highest power being 1."""
    found = [mpmath.mpf(1)]
    for root in roots:
        shifted = [mpmath.mpf(0), *found]
        found = [a - mpmath.mpf(root) * b for a, b in zip(shifted, [*found, 0], strict=True)]
    return found


def lagrange(own: CollocationNodes, k: int) -> list[mpmath.mpf]:
    """Of the polynomial that is 1 at one node and 0 at the others."""
    at = own.at.tolist()
    scale = mpmath.fprod(mpmath.mpf(at[k]) - other for other in np.delete(at, k).tolist())
    return [x / scale for x in with_roots(np.delete(at, k).tolist())]


def of(c: float, k: float) -> ImpulseResponse:
    return impulse_response(LENGTH, c, k, scratch(SERIES), scratch(SERIES))


def filled(own: CollocationNodes, chosen: int, c: float, k: float) -> tuple[np.ndarray, np.ndarray]:
    """A table and its numbers; that of the set before is made first, if it goes on from there."""
    count = len(own.at)
    table, numbers = np.full((lines_of_table(count), count), np.nan), np.full(NUMBERS, np.nan)
    before = filled(own, chosen - 1, c, k)[0] if own.begins[chosen] else table
    fill(own, chosen, of(c, k), before, table, numbers)
    return table, numbers


@pytest.mark.parametrize(
    ("count", "c", "k"),
    [*((8, *each) for each in STIFF), *((n, *each) for n in (4, 16) for each in STIFF[5::4])],
)
def test_responses_are_exact(count: int, c: float, k: float) -> None:
    own = nodes(count, SAMPLES, count)
    with mpmath.workdps(40):
        beyond = [x * own.leading for x in with_roots(own.at.tolist())]
        for chosen in (0, 1, len(own.begins) - 1):
            table, numbers = filled(own, chosen, c, k)
            ends = np.full(count, own.stops[chosen][own.stops[chosen] < 1.5][-1])
            for stop, column in zip(own.stops[chosen], own.columns[chosen], strict=True):
                if column >= 0:
                    ends[column] = stop
            sizes = np.abs(table[:count]).max(), np.abs(table[count : 2 * count]).max()
            for j in (0, count - 1):
                for node in (count // 3, count - 1):
                    x, v = exact(ends[j], c, k, lagrange(own, node))
                    assert abs(table[node, j] - x) < 1e-14 * sizes[0]
                    assert abs(table[count + node, j] - v) < 1e-14 * sizes[1]
                    pull = c * v + k * x
                    assert abs(table[2 * count + node, j] - pull) <= 1e-14 * (
                        c * sizes[1] + k * sizes[0]
                    )
                one, _ = exact(ends[j], c, k, [mpmath.mpf(1)])
                assert table[3 * count, j] == pytest.approx(one, rel=1e-12)
                # From v = 1 at the beginning: as under a force's derivative.
                assert table[3 * count + 1, j] == pytest.approx(
                    exact(ends[j], c, k, [mpmath.mpf(1)])[1], rel=1e-11, abs=1e-16
                )
                x, _ = exact(ends[j], c, k, beyond)
                assert abs(table[3 * count + 3, j] - x) < 1e-13 * abs(table[3 * count]).max()
            assert numbers[BEYOND] == np.abs(table[3 * count + 3]).max()
        one, _ = exact(1.0, c, k, [mpmath.mpf(1)])
        assert of(c, k).to_one == pytest.approx(one, rel=1e-11)
        assert numbers[MOST_UNIT] >= abs(one) * (1.0 - 1e-11)


def fill_first(own: CollocationNodes, c: float, k: float, table: Table, numbers: Floats) -> None:
    """In the subset: a record of arrays on the stack."""
    values, rates = scratch(SERIES), scratch(SERIES)
    fill(own, 0, impulse_response(LENGTH, c, k, values, rates), table, table, numbers)


def test_machine_code_fills_tables_with_the_same_bits() -> None:
    own = nodes(8, SAMPLES, 8)
    for c, k in STIFF:
        expected, numbers = filled(own, 0, c, k)
        found, own_numbers = np.full_like(expected, np.nan), np.full(NUMBERS, np.nan)
        compiled(fill_first)(own, c, k, found, own_numbers)
        assert found.tobytes() == expected.tobytes()
        assert own_numbers.tobytes() == numbers.tobytes()


@pytest.mark.parametrize(("count", "powers"), [(4, 4), (8, 8), (8, 5), (16, 10)])
@pytest.mark.parametrize("ratio", [0.25, 1.0, 2.0])
def test_polynomials_are_carried_on(count: int, powers: int, ratio: float) -> None:
    """Those of fewer powers exactly, of others the part by Legendre's first polynomials."""

    class Method:
        nodes = globals()["nodes"](count, (1,), powers)

    class Own:
        method = Method

    columns = np.empty((count, count))
    put_carry(Own, ratio, columns)  # type: ignore[arg-type]
    at = Method.nodes.at
    coefficients = np.random.default_rng(1).normal(size=powers)
    values = np.polynomial.polynomial.polyval(at, coefficients)
    expected = np.polynomial.polynomial.polyval(1.0 + ratio * at, coefficients)
    np.testing.assert_allclose(values @ columns, expected, rtol=1e-8 if count > 8 else 1e-10)
    if powers < count:
        beyond = np.polynomial.legendre.legval(2.0 * at - 1.0, [0.0] * powers + [1.0])
        assert np.abs(beyond @ columns).max() < 1e-9 * np.abs(columns).max()

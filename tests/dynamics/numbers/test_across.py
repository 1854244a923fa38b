"""What mixes lanes, beside numpy."""

import numba
import numpy as np

from ab_sim.dynamics.numbers.across import column_of, product, put_column, total
from ab_sim.dynamics.numbers.lanes import as_lanes
from ab_sim.integrate.workspace import aligned
from tests.dynamics.calls import OPTIONS


@numba.njit(**OPTIONS)
def mixed(lines, table, into):  # type: ignore[no-untyped-def]
    """Into column 2 the matrix in lines 1 .. 8 times column 1 of the table; returns its sum."""
    found = product(as_lanes(lines), 1, column_of(table, 1))
    put_column(found, into, 2)
    return total(found)


def test_products_sums_and_columns() -> None:
    random = np.random.default_rng(15)
    lines, table, into = aligned((9, 8)), random.normal(size=(9, 3)), np.zeros((9, 3))
    lines[:] = random.normal(size=lines.shape)
    whole = mixed(lines, table, into)
    np.testing.assert_allclose(into[:8, 2], lines[1:].T @ table[:8, 1], rtol=1e-13, atol=1e-14)
    assert whole == np.float64(into[:8, 2].reshape(2, 2, 2).sum(axis=0).sum(axis=0).sum())
    assert not into[8].any() and not into[:, :2].any()

"""Arguments that stay where they are: compiled code reads what was put there, and writes to it."""

from typing import Any, NamedTuple

import numba
import numpy as np
import pytest

from ab_sim.integrate.kept import Kept, values_of


class Inner(NamedTuple):
    floats: tuple[float, float]
    table: np.ndarray
    nothing: tuple[Any, ...]
    absent: None


class Outer(NamedTuple):
    number: int
    flag: bool
    inner: Inner
    counts: np.ndarray
    each: tuple[None, ...]
    size: float


@numba.njit
def read(kept: Any, found: Any) -> int:
    values = values_of(kept)
    inner = values.inner
    found[0], found[1] = values.number, values.flag
    found[2], found[3] = inner.floats
    found[4], found[5] = values.size, len(values.each) + len(inner.nothing)
    found[6], found[7] = inner.table[2, 1], inner.table[-1, -1]
    found[8], found[9] = inner.table.size, values.counts.sum()
    inner.table[0, 1] += 1.0
    values.counts[0] += 1
    return int(values.counts.size)


def outer(number: int, size: float, columns: int) -> Outer:
    table = np.arange(3.0 * columns).reshape(3, columns)
    inner = Inner((size, -2.5), table, (), None)
    return Outer(number, number > 0, inner, np.array([1, 2, 4]), (None, None), size)


@pytest.mark.parametrize(("number", "size", "columns"), [(-(2**60), 1e-300, 2), (7, np.inf, 5)])
def test_what_is_there_is_read_and_written(number: int, size: float, columns: int) -> None:
    """Numbers to the bit, arrays of any length; the second time with the same code."""
    values, found = outer(number, size, columns), np.empty(10)
    kept = Kept(values)
    for again in range(2):
        assert read(kept, found) == 3
        table = values.inner.table
        assert found.tolist() == [
            *(number, number > 0, size, -2.5, size, 2),
            *(table[2, 1], table[-1, -1], table.size, 7 + again),
        ]
        assert table[0, 1] == 2.0 + again
    assert len(read.signatures) == 1


def test_an_array_with_gaps_is_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(3, 2\) is not C-contiguous: copy it"):
        Kept(outer(1, 1.0, 2)._replace(inner=np.empty((2, 3)).T))

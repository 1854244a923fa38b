"""Arrays, views, scratch memory, and records in records."""

from typing import NamedTuple

import numpy as np
import pytest

from ab_sim.engine.compiling import (
    Cube,
    Floats,
    Integers,
    IntegerTable,
    Table,
    compiled,
    scratch,
)
from ab_sim.engine.compiling.library import Module
from tests.compiling.ways import same


class Inner(NamedTuple):
    values: Floats
    scale: float
    on: bool


class Outer(NamedTuple):
    first: Inner
    count: int
    table: Table
    second: Inner
    counts: IntegerTable


class Pair(NamedTuple):
    low: float
    high: float
    at: int


def outer(seed: int = 0) -> Outer:
    random = np.random.default_rng(seed)
    counts = random.integers(-5, 5, (2, 3))
    inner = [Inner(random.normal(size=n), float(random.normal()), n > 4) for n in (4, 5)]
    return Outer(inner[0], 3, random.normal(size=(3, 4)), inner[1], counts)


def parts(own: Outer) -> float:
    inner, table = own.first, own.table
    total = inner.scale * own.second.values[own.count] + float(inner.on)
    total += table[1, 2] + own.counts[1, 0]
    own.counts[0, 1] = own.count
    own.table[0, 0] = own.counts[0, 1]
    return total


def passed_on(own: Outer) -> float:
    return of_inner(own.first, own.count) + of_inner(own.second, 1)


def of_inner(inner: Inner, k: int) -> float:
    return inner.values[k] * inner.scale if inner.on else inner.values[0]


def made(own: Outer, x: float) -> tuple[Pair, Inner, float]:
    pair = Pair(x, 2, own.count)
    for step in range(3):
        before = pair
        pair = Pair(pair.high, before.low + step, pair.at + 1)
    inner = own.second if x > 0.0 else own.first
    chosen = Inner(inner.values[1:3], pair.low, not inner.on)
    return pair, chosen, sum_of(chosen)


def made_without_arrays(own: Outer, x: float) -> tuple[Pair, float]:
    pair, _, total = made(own, x)
    return pair, total


def sum_of(inner: Inner) -> float:
    total = 0.0
    for k in range(inner.values.size):
        total += inner.values[k]
    return total * inner.scale


def swapped(x: float, turns: int) -> Pair:
    a, b = Pair(x, 1.0, 0), Pair(2.0, x, 5)
    for _ in range(turns):
        a, b = b, a
        a = Pair(a.high, a.low, b.at)
    return a


def whole_and_views(cube: Cube, out: Floats, k: int) -> tuple[int, int, int, int]:
    table = cube[k]
    row, part = table[1], cube[0, 1, 1:3]
    out[0] = cube[1, 0, 2] + row[2] + part[0]
    rows, rest = table[k : k + 1], out[2:]
    rows[0, 0] = 7.0
    rest[0] = rows[0, 1]
    row[:2][1] = -1.0
    cube[1:][0][0, 1] += 0.5
    n, m = table.shape
    out[1] = n * 10 + m + part.size + rest.shape[0]
    return cube.size, rows.size, rest.shape[0], cube.shape[2]


def swapped_elements(x: Floats, i: int, counts: Integers) -> None:
    x[i], x[i + 1] = x[i + 1], x[i]
    x[i] = x[0] = x[1] + counts[0]
    counts[i] -= i
    counts[0] = True


def shifted(source: Floats, target: Floats) -> None:
    for k in range(source.size):
        target[k] = source[k] + 1.0
    target[0] += source[0] + target[0]


def with_scratch(n: int, out: Floats) -> float:
    room, square, total = scratch(n), scratch(2, 3), 0.0
    for k in range(n):
        room[k] = out[k] * out[k]
    for k in range(3):
        again = scratch(4)
        for j in range(4):
            again[j] = k * j
        square[0, k], square[1, k] = again[1], again[3]
    for k in range(3):
        total += square[0, k] * square[1, 2 - k]
    return total + room[n - 1] + room.size + square.shape[0]


def with_scratch_in_calls(n: int) -> float:
    own = scratch(n + 1)
    own[0] = n
    if n == 0:
        return 1.0
    below = with_scratch_in_calls(n - 1)
    return own[0] * below


def address_sum(out: Floats) -> None:
    small, large = scratch(1), scratch(3, 5)
    small[0] = large[2, 4] = 1.0
    inner = Inner(small, 1.0, True)
    out[0] = inner.values[0] + large[2][4]


class Several(NamedTuple):
    inner: tuple[Inner, Inner]
    both: tuple[Outer, Outer]


def each_of_several(several: Several) -> float:
    total, k = 0.0, 0
    for inner in several.inner:
        inner.values[k] += of_inner(inner, 1)
        for outer in several.both:
            total += outer.count * outer.second.scale + inner.values[k]
        k += 1
    for inner in several.inner:
        again = inner
        inner = again  # it may be assigned to, too
        total += sum_of(inner)
    return total


def test_records_of_a_tuple_are_not_copied_in_a_loop() -> None:
    several = Several((outer(1).first, outer(2).second), (outer(3), outer(4)))
    same(each_of_several, several)
    lines = Module(each_of_several, {}).text().splitlines()
    assert len(lines) < 400, "with copies it has 600"


def test_records_in_records() -> None:
    for seed in range(5):
        same(parts, outer(seed))
        same(passed_on, outer(seed))
        same(made_without_arrays, outer(seed), 0.5)
        same(made_without_arrays, outer(seed), -0.5)


@pytest.mark.parametrize("turns", range(4))
def test_records_are_values(turns: int) -> None:
    same(swapped, 0.25, turns)


def test_a_record_as_a_result_is_one_in_python() -> None:
    found = compiled(swapped)(0.25, 1)
    assert isinstance(found, Pair) and isinstance(found.low, float) and type(found.at) is int
    assert compiled(made_without_arrays)(outer(), 1.0)[0].at == 6


@pytest.mark.parametrize("k", [0, 1])
def test_views(k: int) -> None:
    same(whole_and_views, np.arange(24.0).reshape(2, 3, 4), np.zeros(6), k)


def test_elements_are_assigned_in_python_s_order() -> None:
    same(swapped_elements, np.array([1.0, 2.0, 3.0]), 1, np.array([4, 5]))


def test_arrays_may_be_the_same_memory() -> None:
    """As the source is read anew after each number is written."""
    machine, python = np.arange(6.0), np.arange(6.0)
    compiled(shifted)(machine[:-1], machine[1:])
    shifted(python[:-1], python[1:])
    assert machine.tolist() == python.tolist()


def test_scratch_memory() -> None:
    same(with_scratch, 3, np.array([1.0, 2.0, 3.0]))
    assert same(with_scratch_in_calls, 6) == 720.0
    same(address_sum, np.zeros(1))


def test_scratch_in_python_is_aligned() -> None:
    for shape in [(1,), (7,), (3, 5)]:
        made_here = scratch(*shape)
        assert made_here.shape == shape and made_here.ctypes.data % 64 == 0
        made_here[...] = 1.0

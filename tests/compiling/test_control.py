"""Statements: loops, branches, ways out of both, and names."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ab_sim.engine.compiling import Floats, Integers, IntegerTable, Table, compiled
from tests.compiling.ways import same


def ranges(a: int, b: int, out: Floats) -> int:
    k = -7
    for k in range(a):
        out[0] += k
        k = 100
    out[1] = k
    for k in range(a, b):
        out[2] += 2 * k
    for k in range(b, a, -2):
        out[3] += k * k
    for k in range(a, b, 3):
        b -= 1
        out[4] += k + b
    return k


def first_above(x: Table, least: float) -> tuple[int, int]:
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            if x[i, j] > least:
                return i, j
            elif x[i, j] < -least:
                break
    else_found = -1
    return else_found, 0


def around_and_around(limit: int) -> int:
    count, total = 0, 0
    while True:
        count += 1
        if count % 3 == 0:
            continue
        if count > limit:
            break
        total += count
        inner = count
        while inner > 0 and total < 1000:
            inner -= 2
            if inner == 5:
                break
    return total


def unrolled(x: Table, stop: float) -> float:
    total, column = 0.0, -1
    for column in (2, 0, 1):
        if x[0, column] > stop:
            break
        if x[0, column] < -stop:
            continue
        total += x[0, column]
    for i, weight in ((0, 1.5), (2, -0.5)):
        total += x[1, i] * weight
    for i in (int(total) % 2, 1):
        total -= x[1, i]
    return total + column


def branches(x: float) -> int:
    if x > 2.0:
        y = 3
    elif x > 1.0:
        y = 2
        if x > 1.5:
            return 7
    elif x == 0.0:
        pass
        y = 0
    else:
        if x < -1.0:
            y = 1
        else:
            return -1
    return y


def counted(counts: Integers, which: int) -> bool:
    counts[which] += 1
    return which % 2 == 0


def short_circuits(counts: Integers, a: int, b: int) -> tuple[bool, bool, bool]:
    one = counted(counts, a) and counted(counts, b)
    other = counted(counts, a) or counted(counts, b) or counted(counts, 1)
    third = a < b < 4 and not (counted(counts, 2) and a == 1)
    return one, other, third


def chosen(x: float, i: int) -> tuple[float, float, int, bool]:
    a = x if x > 0.0 else 1.0
    b = x if i > 2 else i
    c = (1 if i > 3 else 2) if x < 1.0 else (3 if i > 5 else i // 2)
    return a, b, c, x > 0.0 if i > 0 else i < -2


def names(x: float) -> tuple[float, float, float, int]:
    a = b = x
    a, b = b + 1.0, a
    a, b = b, a
    c = 0.0
    d, e = (1, 2), 3
    c += d[0] + e
    (f, g), _ = (a, 2), x
    total = 0.0
    total = g
    return a, b, c + f, int(total)


def nothing(x: Floats) -> None:
    """Returns early, and falls off its end."""
    if x[0] > 0.0:
        x[0] = -1.0
        return
    x[0] = 5.0
    x[1] = 5.0 if x[1] else 6.0


def recursive(n: int, out: Floats) -> int:
    if n < 2:
        return n
    out[n] += 1.0
    return recursive(n - 1, out) + recursive(n - 2, out)


def truth(i: int, x: float, table: IntegerTable) -> int:
    found = 0
    while i:
        i -= 1
        if x:
            if table[0, i]:
                found += 1
    return found if not x else -found


def one_name_in_two_loops(x: Floats) -> float:
    total = 0.0
    for k in (0, 1):
        for k in range(2):
            total += x[k]
        total += x[k]
    return total


@given(st.integers(-3, 9), st.integers(-3, 9))
@settings(max_examples=60)
def test_loops_over_ranges(a: int, b: int) -> None:
    same(ranges, a, b, np.zeros(5))


@given(st.lists(st.sampled_from([-3.0, -0.5, 0.0, 0.5, 3.0]), min_size=6, max_size=6))
@settings(max_examples=60)
def test_ways_out_of_loops(values: list[float]) -> None:
    x = np.array(values).reshape(2, 3)
    same(first_above, x, 1.0)
    same(unrolled, x, 1.0)
    same(one_name_in_two_loops, x[0])


@pytest.mark.parametrize("limit", [0, 1, 10, 100])
def test_loops_without_end(limit: int) -> None:
    same(around_and_around, limit)


@given(st.floats(-3.0, 3.0) | st.sampled_from([0.0, 1.0, 2.0, math.nan]), st.integers(-3, 7))
@settings(max_examples=100)
def test_branches_and_choices(x: float, i: int) -> None:
    same(branches, x)
    same(chosen, x, i)
    same(names, x)
    same(nothing, np.array([x, float(i)]))


@given(st.integers(0, 4), st.integers(0, 4))
@settings(max_examples=25)
def test_what_need_not_be_known_is_not_looked_at(a: int, b: int) -> None:
    same(short_circuits, np.zeros(5, np.int64), a, b)


def test_a_function_may_call_itself() -> None:
    assert same(recursive, 9, np.zeros(10)) == 34


def test_numbers_are_true_unless_zero() -> None:
    table = np.array([[0, 5, 0, -2]])
    assert same(truth, 4, 0.5, table) == -2
    assert same(truth, 4, 0.0, table) == 0


def test_a_result_that_is_none() -> None:
    assert compiled(nothing)(np.zeros(2)) is None

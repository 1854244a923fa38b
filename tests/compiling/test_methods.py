"""Methods of records, and functions for every class of records with some methods."""

from typing import NamedTuple, Protocol

import numpy as np
import pytest

from ab_sim.engine.compiling import Compiled, Floats, Library, Untranslatable, compiled
from ab_sim.engine.compiling.library import Module
from ab_sim.engine.compiling.source import for_class
from tests.compiling.ways import same


class Method(Protocol):
    @property
    def state(self) -> Floats: ...

    def take(self, k: int) -> bool: ...


class Sum(NamedTuple):
    state: Floats
    limit: float

    def take(self, k: int) -> bool:
        self.state[0] += float(k)
        return self.is_within(self.limit)

    def is_within(self, limit: float) -> bool:
        return self.state[0] < limit


class Product(NamedTuple):
    factor: float
    state: Floats

    def take(self, k: int) -> bool:
        for _ in range(k):
            self.state[0] *= self.factor
        return True


def advance(method: Method, steps: int) -> float:
    for k in range(steps):
        if not taken(method, k):
            break
    return method.state[0]


def taken(method: Method, k: int) -> bool:
    return method.take(k)


def both(one: Sum, other: Product, steps: int) -> float:
    return advance(one, steps) - advance(other, steps)


def without_method(one: Sum) -> bool:
    return one.undo(1)  # type: ignore[attr-defined,no-any-return]


def with_too_few(one: Sum) -> bool:
    return one.take()  # type: ignore[call-arg]


@pytest.mark.parametrize("steps", [0, 1, 5, 9])
def test_one_loop_for_all_methods(steps: int) -> None:
    one, other = Sum(np.array([0.5]), 7.0), Product(1.25, np.array([3.0]))
    assert same(advance, one, steps) == min(0.5 + steps * (steps - 1) / 2, 10.5)
    assert same(advance, other, steps) == pytest.approx(3.0 * 1.25 ** (steps * (steps - 1) // 2))
    same(both, one, other, steps)


def test_calls_of_methods_are_direct() -> None:
    text = Module(for_class(advance, Product), {}).text()  # type: ignore[arg-type]
    calls = [line for line in text.splitlines() if "call " in line]
    assert any("Product.take" in line for line in calls) and "Sum" not in text
    assert all("@" in line for line in calls)


def test_each_class_is_compiled_once() -> None:
    library = Library()
    loop = Compiled(advance, library=library)
    loop(Sum(np.zeros(1), 7.0), 2)
    size = library.size
    loop(Sum(np.ones(1), 9.0), 3)
    assert library.size == size
    loop(Product(2.0, np.ones(1)), 2)
    assert library.size == size + 3


def test_errors_name_the_method() -> None:
    one = Sum(np.zeros(1), 7.0)
    with pytest.raises(Untranslatable, match=r"call of one\.undo;"):
        compiled(without_method)(one)
    with pytest.raises(Untranslatable, match=r"one\.take takes 2 arguments"):
        compiled(with_too_few)(one)

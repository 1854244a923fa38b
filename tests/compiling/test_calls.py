"""Machine code called from Python, and emitted code called from the subset."""

import copy
import ctypes
import math
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.engine.compiling import (
    Compiled,
    Floats,
    Integers,
    KeptArray,
    Table,
    Untranslatable,
    call,
    compiled,
    scratch,
)
from ab_sim.tracing import Graph, cos, lowered
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, module_text
from ab_sim.tracing.machine_code import MachineCode


class Own(NamedTuple):
    x: Floats
    scale: float
    on: bool


class Whole(NamedTuple):
    own: Own
    count: int


def scaled(whole: Whole, k: int, by: float, out: Table) -> float:
    out[k, 0] = whole.own.x[k] * by
    return out[k, 0] + whole.own.scale if whole.own.on else float(whole.count)


def is_more(x: float, y: float) -> bool:
    return x > y


def halves(x: float, count: int) -> int:
    return int(2.0 * x) + count


def of_all_kinds(x: float, i: int, b: bool, own: Own) -> tuple[bool, int, float, Own]:
    return not b, i + 1, x + own.scale, own


def sums(x: float, i: int, b: bool, own: Own, counts: Integers) -> tuple[bool, int, float]:
    return not b and own.on, i + counts[0], x + own.scale + own.x[0]


def waiting(address: int) -> None:
    call(address)


@compiled
def decorated(x: float) -> float:
    return 2.0 * x


def calls_decorated(x: float) -> float:
    return decorated(x) + 1.0


def through(address: int, x: Floats, y: Floats) -> float:
    own = Own(x, 2.0, True)
    room = scratch(2)
    call(address, x, room)
    call(address, own.x[1:], y)
    return room[0] + own.scale


def numbers_through(address: int, i: int, x: float, y: Floats) -> None:
    call(address, i, x, y, 3, 0.5, y[1:])


def whole(on: bool = True) -> Whole:
    return Whole(Own(np.arange(5.0), 0.5, on), 7)


def test_a_bound_argument_is_looked_at_once() -> None:
    first, out = whole(), np.zeros((5, 2))
    bound = compiled(scaled).bind(first)
    assert bound(3, 2.0, out) == 6.5 and out[3, 0] == 6.0
    first.own.x[3] = -1.0
    assert bound(3, 2.0, out) == -1.5, "what is in its arrays is read at each call"
    bound.rebind(whole(on=False))
    assert bound(2, 1.0, out) == 7.0
    assert compiled(scaled) is compiled(scaled)
    assert compiled(scaled)(first, 3, 2, out) == -1.5
    assert compiled(scaled)(first, np.int64(3), np.float64(2.0), out) == -1.5


def test_more_arguments_can_be_bound() -> None:
    out = np.zeros((5, 2))
    bound = compiled(scaled).bind(whole())
    third = bound.bind(3)
    assert third(2.0, out) == 6.5 and out[3, 0] == 6.0
    assert third.bind(4.0)(out) == 12.5
    assert bound(2, 2.0, out) == 4.5, "what it was made of is as it was"
    with pytest.raises(TypeError, match="scaled: by .* float, not 'a'"):
        third("a", out)
    with pytest.raises(TypeError, match="scaled: takes 4 .*, 3 are"):
        third(2.0)
    with pytest.raises(TypeError, match="scaled: k .* int, not 1.5"):
        bound.bind(1.5)
    with pytest.raises(TypeError, match="by .* float, -1.79.* to 1.79.*, not 1000"):
        third.bind(10**400)
    with pytest.raises(TypeError, match="scaled: takes 4 .*, 5 are"):
        third.bind(2.0, out, 1)


def test_a_kept_array_is_an_array() -> None:
    bound, kept = compiled(scaled).bind(whole()), KeptArray(np.zeros((5, 2)))
    assert bound(3, 2.0, kept) == 6.5 and kept.array[3, 0] == 6.0
    for other in (np.zeros(5), np.zeros((5, 2), int)):
        with pytest.raises(TypeError, match="out .* 2-D array of floats"):
            bound(3, 2.0, KeptArray(other))
    with pytest.raises(TypeError, match="C-contiguous"):
        KeptArray(np.zeros((2, 5)).T)
    other = copy.deepcopy(kept)
    kept.array[:] = 0.0
    assert bound(3, 2.0, other) == 6.5 and other.array[3, 0] == 6.0 and not kept.array.any()


def test_a_bound_argument_s_arrays_stay() -> None:
    bound = compiled(scaled).bind(Whole(Own(np.full(1000, 3.0), 0.0, True), 0))
    for _ in range(100):
        np.full(1000, 7.0)
    assert bound(999, 1.0, np.zeros((1000, 1))) == 3.0


def test_all_kinds_of_arguments_and_results() -> None:
    own = Own(np.array([4.0]), 0.25, True)
    counts = np.array([10])
    assert compiled(sums)(1, 2, False, own, counts) == (True, 12, 5.25)
    assert type(compiled(sums)(1, 2, False, own, counts)[0]) is bool
    assert compiled(is_more)(2.0, 1.0) is True and compiled(is_more)(1.0, 1.0) is False
    assert compiled(halves)(-2.0, 2**40) == 2**40 - 4
    with pytest.raises(Untranslatable, match="array as a result"):
        compiled(of_all_kinds)(1.0, 2, True, own)


WRONG: list[tuple[Any, tuple[Any, ...], str]] = [
    (whole(), ("a", 1.0, np.zeros((5, 2))), "scaled: k .* int, not 'a'"),
    (whole(), (1.0, 1.0, np.zeros((5, 2))), "scaled: k .* int, not 1.0"),
    (
        whole(),
        (2**63, 1.0, np.zeros((5, 2))),
        "k must be int, .*to 9.22.*, not 9223372036854775",
    ),
    (whole(), (1, 10**400, np.zeros((5, 2))), r"scaled: by .* float, .*to 1.79.*, not 1000"),
    (whole(), (1, -(10**5000), np.zeros((5, 2))), "not <int of too many digits"),
    (Whole(whole().own._replace(scale=10**400), 1), (), "whole.own.scale must be float, .*1.79"),
    (whole(), (1, None, np.zeros((5, 2))), "scaled: by .* float, not None"),
    (whole(), (1, 1.0, np.zeros(5)), r"scaled: out .* 2-D array .*shape \(5,\)"),
    (whole(), (1, 1.0, np.zeros((5, 2), int)), "not int64"),
    (whole(), (1, 1.0, np.zeros((5, 2), ">f8")), "not >f8"),
    (whole(), (1, 1.0, np.zeros((2, 5)).T), r"C-contiguous.*strides \(8, 40\)"),
    (whole(), (1, 1.0, [[0.0]]), "not list"),
    (whole(), (1, 1.0), "scaled: takes 4 .*, 3 are"),
    (whole(), (1, 1.0, np.zeros((5, 2)), 3), "takes 4 .*, 5 are"),
    (whole().own, (1, 1.0, np.zeros((5, 2))), "scaled: whole .* Whole, not Own"),
    (whole()._replace(count=1.5), (1, 1.0, np.zeros((5, 2))), "whole.count must be int"),
    (Whole(whole().own._replace(x=np.zeros(9)[::2]), 1), (), "whole.own.x must be a 1-D"),
]


@pytest.mark.parametrize("first, others, message", WRONG)
def test_wrong_arguments_are_told(first: Any, others: tuple[Any, ...], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        compiled(scaled)(first, *others)


def test_an_array_that_may_not_be_written_to_is_told() -> None:
    out = np.zeros((5, 2))
    out.flags.writeable = False
    with pytest.raises(TypeError, match="read-only"):
        compiled(scaled)(whole(), 1, 1.0, out)


def test_only_functions_are_compiled() -> None:
    with pytest.raises(TypeError, match="written with def"):
        compiled(abs)


def test_a_decorated_function_can_be_called_from_others() -> None:
    assert calls_decorated(1.5) == compiled(calls_decorated)(1.5) == 4.0


def emitted() -> tuple[MachineCode, int]:
    """y[0] = cos x[0] + x[1], and its code, to be kept."""
    graph, into = Graph(), Function("cosine", ["x", "y"], Shape(1))
    (root,) = lowered([cos(graph.input("a")) + graph.input("b")])
    Body(into, {"a": MemorySlot("x", 0), "b": MemorySlot("x", 1)}).store(root, MemorySlot("y", 0))
    code = MachineCode(module_text([into]))
    return code, code.address("cosine")


@pytest.mark.parametrize("way", [through, compiled(through)])
def test_emitted_code_is_called_at_its_address(way: Callable[..., float]) -> None:
    code, address = emitted()
    x, y = np.array([0.5, 2.0, 3.0]), np.zeros(1)
    assert way(address, x, y) == pytest.approx(math.cos(0.5) + 2.0 + 2.0)
    assert y[0] == pytest.approx(math.cos(2.0) + 3.0)
    del code


def test_in_python_an_address_may_be_a_callable() -> None:
    def double(x: np.ndarray, y: np.ndarray) -> None:
        y[0] = 2.0 * x[0]

    y = np.zeros(1)
    assert through(double, np.array([0.5, 2.0]), y) == 3.0  # type: ignore[arg-type]
    assert y[0] == 4.0


def test_numbers_go_to_emitted_code_as_c_has_them() -> None:
    pointer, number, whole = ctypes.POINTER(ctypes.c_double), ctypes.c_double, ctypes.c_int64

    def put(i: int, x: float, y: Any, three: int, half: float, behind: Any) -> None:
        y[0], behind[0] = i + x, three + half

    kind = ctypes.CFUNCTYPE(None, whole, number, pointer, whole, number, pointer)
    function = kind(put)
    address = ctypes.cast(function, ctypes.c_void_p).value
    assert address
    for way in (numbers_through, compiled(numbers_through)):
        y = np.zeros(2)
        way(address, -2, 0.25, y)
        assert y.tolist() == [-1.75, 3.5]


def test_threads_may_ask_for_the_same_function_at_once() -> None:
    own, found = Compiled(scaled.__wrapped__ if hasattr(scaled, "__wrapped__") else scaled), []

    def ask(k: int) -> None:
        bound, out = own.bind(whole()), np.zeros((5, 2))
        found.append(all(bound(k, float(j), out) == k * j + 0.5 for j in range(2000)))

    threads = [threading.Thread(target=ask, args=(k % 5,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [True] * 8


def test_python_goes_on_meanwhile() -> None:
    """A thread in machine code waits until another one, in Python, lets it go."""
    entered, let_go = threading.Event(), threading.Event()

    def wait() -> None:
        entered.set()
        let_go.wait(20.0)

    function = ctypes.CFUNCTYPE(None)(wait)
    address = ctypes.cast(function, ctypes.c_void_p).value
    thread = threading.Thread(target=compiled(waiting), args=(address,))
    thread.start()
    assert entered.wait(20.0)
    let_go.set()
    thread.join(20.0)
    assert not thread.is_alive()


def test_a_call_takes_little() -> None:
    bound, out = compiled(scaled).bind(whole()), np.zeros((5, 2))
    best = math.inf
    for _ in range(20):
        begin = time.perf_counter()
        for _ in range(500):
            bound(1, 2.0, out)
        best = min(best, (time.perf_counter() - begin) / 500)
    assert best < 10e-6, "2 us or so, on a machine that may be busy"

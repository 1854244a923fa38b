"""Operations across lanes: machine code has the bits of expressions written out lane by lane."""

import ctypes

import numpy as np
import pytest

from ab_sim.tracing import Graph, derivatives, lowered, total
from ab_sim.tracing.expression import Expression
from ab_sim.tracing.functions import across, lane
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, module_text
from ab_sim.tracing.machine_code import MachineCode
from ab_sim.tracing.plain import python_function
from ab_sim.tracing.unrolled import name_of, unrolled
from tests.collocation.unrolled_lanes import name_in, unrolled_lanes

BALLS = 3
NARROW = "+sse4.2,+avx,+avx2,+fma,-avx512f"
LANES = ["x", *(name_of("p", i) for i in range(BALLS))]
UNIFORM = ("m",)


def formulas(graph: Graph, lanes: int) -> list[Expression]:
    """What differs from lane to lane, and at last what does not."""
    x, p, m = graph.input("x"), graph.input("p", each=True), graph.input("m")
    product = m * lane(x, 0)
    for k in range(1, lanes):
        product = product + (x + float(k)) * lane(p, k)
    return [total(product), across(abs(x) * m) * x, across(total(p * p)) + lane(x, lanes - 1)]


def by_machine(lanes: int, given: np.ndarray, m: float, features: str | None) -> list[np.ndarray]:
    shape = Shape(BALLS, lanes)
    into = Function("evaluate", ["x", "m", "out", "one"], shape, uniform=["m", "one"])
    places = {"x": MemorySlot("x", 0), "p": MemorySlot("x", 1), "m": MemorySlot("m", 0)}
    body = Body(into, places)
    roots = lowered(formulas(Graph(), lanes))
    for at, root in enumerate(roots[:2]):
        body.store(root, MemorySlot("out", at))
    body.store(roots[2], MemorySlot("one", 0))
    code = MachineCode(module_text([into]), features)
    call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4)(code.address("evaluate"))
    own, out, one = np.array([m]), np.empty((2, lanes)), np.empty(1)
    call(*(array.ctypes.data for array in (given, own, out, one)))
    return [*out, np.full(lanes, one[0])]


@pytest.mark.parametrize("lanes", [1, 2, 4, 8, 16])
def test_lanes_of_machine_code_are_those_written_out(lanes: int) -> None:
    random = np.random.default_rng(lanes)
    given, m = random.normal(size=(1 + BALLS, lanes)), 0.3
    roots = [each[0] for each in unrolled(lowered(formulas(Graph(), lanes)), BALLS)]
    flat = unrolled_lanes(roots, lanes, lambda name: name in UNIFORM)
    names = {name_in(name, k): f"{name}_{k}" for name in LANES for k in range(lanes)}
    names = {name: text.replace("[", "_").replace("]", "") for name, text in names.items()}
    values = {names[name_in(LANES[j], k)]: given[j, k] for j in range(4) for k in range(lanes)}
    plain = python_function([x for root in flat for x in root], names | {"m": "m"})
    expected = iter(plain(**{name: float(value) for name, value in values.items()}, m=m))
    written = [np.array([next(expected) for _ in root]) for root in flat]
    for features in (None, NARROW):
        for found, one in zip(by_machine(lanes, given, m, features), written, strict=True):
            assert found.tobytes() == np.broadcast_to(one, lanes).tobytes()


def test_functions_of_arrays_are_those_of_expressions() -> None:
    x = np.arange(8.0)
    assert lane(x, 3) == 3.0 and across(x) == 28.0
    graph = Graph()
    a, d = graph.input("a"), graph.input("d")
    mixed = across(lane(a * a, 2) * a)
    (rate,) = derivatives([mixed], {a: d})
    assert rate is across(lane(d * a + a * d, 2) * a + lane(a * a, 2) * d)

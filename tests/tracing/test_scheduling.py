"""Order in which expressions are computed, and the stack on which emitted code keeps values."""

import llvmlite.binding as llvm
import numpy as np

from ab_sim.engine.compiling.kinds import call
from ab_sim.tracing import Expression, Graph, lowered
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, StoredRoot, module_text
from ab_sim.tracing.machine_code import MachineCode
from ab_sim.tracing.scheduling import scheduled


def powers(x: Expression, count: int) -> list[Expression]:
    """Return x, x x, x x x and so on, each computed from the one before."""
    found = [x]
    while len(found) < count:
        found.append(found[-1] * x)
    return found


def test_chains_of_operations_take_turns() -> None:
    graph = Graph()
    one, other = (powers(graph.input(name), 4) for name in "ab")
    order = scheduled([one[-1], other[-1]], 1)
    assert order == [x for pair in zip(one[1:], other[1:], strict=True) for x in pair]


def test_what_most_operations_wait_for_comes_first() -> None:
    graph = Graph()
    a, b = graph.input("a"), graph.input("b")
    late, long = a + b, powers(a - b, 3)
    assert scheduled([late, long[-1]], 1)[0] is long[0]
    assert scheduled([long[-1]], 1, {long[0].number}) == long[1:]


def test_others_fill_the_four_cycles_until_a_result_is_available() -> None:
    graph = Graph()
    long = powers(graph.input("a"), 4)
    others = [long[0] + graph.input(f"b{k}") for k in range(9)]
    order = scheduled([long[-1], *others], 1)
    assert [order.index(x) for x in long[1:]] == [0, 4, 8]


def all_powers(lanes: int, count: int) -> Function:
    """Emit a function that stores the powers of two numbers from the highest to the lowest."""
    graph = Graph()
    roots = lowered([x for name in "ab" for x in powers(graph.input(name), count)])
    into = Function("powers", ["y", "out"], Shape(1, lanes))
    stores = [StoredRoot(x, MemorySlot("out", k)) for k, x in enumerate(roots)]
    Body(into, {"a": MemorySlot("y", 0), "b": MemorySlot("y", 1)}).store_all(stores[::-1])
    return into


def test_all_roots_are_stored_also_inputs() -> None:
    code, out = MachineCode(module_text([all_powers(1, 5)])), np.zeros(10)
    call(code.address("powers"), np.array([2.0, 3.0]), out)
    assert out.tolist() == [2.0, 4.0, 8.0, 16.0, 32.0, 3.0, 9.0, 27.0, 81.0, 243.0]


def test_vectors_on_the_stack_are_aligned() -> None:
    """Otherwise, code takes up to 1.3 times as long, by chance of its caller's stack."""
    roots = lowered(powers(Graph().input("a"), 60))
    into = Function("late", ["y", "out"], Shape(1, 8))
    body = Body(into, {"a": MemorySlot("y", 0)})
    for k in reversed(range(len(roots))):
        body.store(roots[k], MemorySlot("out", k))
    text = module_text([into])
    MachineCode(text)  # initialises LLVM
    machine = llvm.Target.from_default_triple().create_target_machine(features="+avx512f", opt=3)
    lines = machine.emit_assembly(llvm.parse_assembly(text)).splitlines()
    spills = [line for line in lines if "(%rsp)" in line and "zmm" in line]
    assert spills and all("mova" in line or "vadd" in line for line in spills), spills

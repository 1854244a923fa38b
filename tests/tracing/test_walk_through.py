"""A formula on its way: as floats, as expressions, differentiated, printed, and as machine code."""

import numpy as np

from ab_sim.engine.kernels.code import called
from ab_sim.tracing import Graph, Level, cos, derivatives, lowered, total, where
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, module_text
from ab_sim.tracing.machine_code import MachineCode
from ab_sim.tracing.notations import latex, latex_symbol, plain_text


def pull(k, u, m, theta, rate):  # type: ignore[no-untyped-def]
    """Return the force of forward-running balls and a spring on a deck [N]."""
    return total(where(rate < 0.0, 0.0, m * rate**2) * cos(theta)) - k * u


def test_walk_through() -> None:
    # With floats and arrays a formula computes.
    theta, rate = np.array([0.5, 2.0, -1.0]), np.array([30.0, -5.0, 8.0])
    plain = pull(1000.0, 1e-4, 1e-3, theta, rate)

    # With expressions it records its operations; a per-ball quantity is one expression.
    graph = Graph()
    k, m = (graph.input(name, Level.PARAMETER) for name in ("k", "m"))
    u = graph.input("u")
    angles, rates = (graph.input(name, per_ball=True) for name in ("theta", "rate"))
    force = pull(k, u, m, angles, rates)

    # Expressions can be differentiated and printed.
    turned = graph.input("d theta", per_ball=True)
    (change,) = derivatives([force], {angles: turned})
    assert plain_text(force) == "sum_i (0 if rate_i < 0, else m rate_i^2) cos(theta_i) - k u"
    assert plain_text(change) == "-sum_i (0 if rate_i < 0, else m rate_i^2) d theta_i sin(theta_i)"
    assert latex(k * u, latex_symbol) == r"k \, u"

    # Lowering replaces cosines by polynomials and writes out fused multiply-adds. The result is
    # emitted for a number of balls, and called.
    places = {"k": MemorySlot("c", 0), "m": MemorySlot("c", 1), "u": MemorySlot("y", 0)}
    places |= {"theta": MemorySlot("y", 1), "rate": MemorySlot("y", 4)}
    places["d theta"] = MemorySlot("d", 0)
    into = Function("pull", ["c", "y", "d", "out"], Shape(balls=3))
    body = Body(into, places)
    for at, root in enumerate(lowered([force, change])):
        body.store(root, MemorySlot("out", at))
    code = MachineCode(module_text([into]))  # lives as long as this object
    c, y, out = np.array([1000.0, 1e-3]), np.concatenate([[1e-4], theta, rate]), np.empty(2)
    called(code.address("pull"), c, y, np.array([1.0, 0.0, 0.0]), out)
    assert abs(out[0] - plain) < 1e-15
    assert abs(out[1] + 1e-3 * 30.0**2 * np.sin(0.5)) < 1e-15

"""What a step of an explicit Runge-Kutta method makes of changes, emitted.

``carry(c, b, t, at, sums, change, lasts, starts, dc, db, along, rates, begin, length)`` takes the
columns of one block from a step's beginning to its end, given the states of its stages. Arrays are
those of ``stepping.tangents``.
"""

from collections.abc import Sequence

import numpy as np

from ab_sim.kernels.emission import BRANCHES, CONSTANTS, TIMES
from ab_sim.tracing.functions import GROUP
from ab_sim.tracing.llvm_text import Function, MemorySlot, literal, module_text

POINTERS = ("at", "sums", "change", "lasts", "starts", "dc", "db", "along", "rates")


def carry_text(tangent: Function, size: int, tableau: Sequence[np.ndarray]) -> str:
    """The function's text, with that of the slope's change, which it calls.

    Args:
        tangent: ``slope(c, b, t, y, d, dc, db, out)`` of ``tangent``.
        size: how many states there are.
        tableau: a, b, c of the method.
    """
    a, weights, nodes = tableau
    shape = tangent.shape
    pointers = [CONSTANTS, BRANCHES, TIMES, *POINTERS]
    uniform = [CONSTANTS, BRANCHES, TIMES, "at", "sums"]
    into = Function("carry", pointers, shape, ["begin", "length"], uniform)
    lanes, stages = shape.lanes, len(weights)
    # In lanes each state is a vector; else states are, by groups.
    by = 1 if lanes > 1 else GROUP
    pieces = [(j, min(by, size - j)) for j in range(0, size, by)]
    widths = {width: width * lanes for _, width in pieces}
    starts = into.load(MemorySlot("starts", 0), 0, 1)
    lasts = into.load(MemorySlot("lasts", 0), 0, 1)
    wide = {w: lasts if lanes > 1 or w == 1 else into.widened(lasts, w) for w in widths}
    change = [into.load(MemorySlot("change", j), 0, width) for j, width in pieces]

    def put(row: np.ndarray, stage: int, where: str) -> None:
        """The change at a stage, or at the end."""
        factors = {
            q: into.put(f"fmul double {literal(float(weight), 1)}, %length")
            for q, weight in enumerate(row[:stage])
            if weight != 0.0
        }
        for (j, width), own in zip(pieces, change, strict=True):
            whole = widths[width]
            total = into.load(MemorySlot("sums", stage * size + j), 0, width)
            total = into.call("fma", whole, wide[width], total, own)
            for q, factor in factors.items():
                rate = into.load(MemorySlot("rates", q * size + j), 0, width)
                of = factor if whole == 1 else into.widened(factor, whole)
                total = into.call("fma", whole, of, rate, total)
            into.store(total, MemorySlot(where, j), 0, whole)

    for i in range(stages):
        put(a[i], i, "along")
        node = float(nodes[i])
        when = into.call("fma", lanes, literal(node, lanes), lasts, starts)
        into.store(when, MemorySlot("along", size), 0, lanes)
        time = into.call("fma", 1, literal(node, 1), "%length", "%begin")
        into.lines.append(f"store double {time}, ptr %{TIMES}, align 8")
        there = into.put(f"getelementptr double, ptr %at, i64 {i * size}")
        rates = into.put(f"getelementptr double, ptr %rates, i64 {i * size * lanes}")
        given = [f"%{CONSTANTS}", f"%{BRANCHES}", f"%{TIMES}", there, "%along", "%dc", "%db", rates]
        arguments = ", ".join(f"ptr {each}" for each in given)
        into.lines.append(f"call void @{tangent.name}({arguments})")
    put(weights, stages, "change")
    return module_text([tangent, into])

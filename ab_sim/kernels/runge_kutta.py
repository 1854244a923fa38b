"""Emit a step of an explicit Runge-Kutta method, with the state in registers.

All stages call one function that takes a state and returns a slope as values. So the stages need no
arrays in memory, and the code of the equations exists only once.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.kernels.emission import BRANCHES, CONSTANTS, TIMES, Emission
from ab_sim.tracing import Expression
from ab_sim.tracing.functions import GROUP
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, kind, literal


class StatePart(NamedTuple):
    """Adjacent numbers of a state that are held in one vector."""

    first: int
    width: int
    """Number of states in the vector; in lanes always one."""


def pieces_of(emission: Emission, lanes: int) -> list[StatePart]:
    """Return the division of a state into vectors: deck's states by 2 or 4, balls' by groups."""
    model = emission.model
    own, n = model.states, model.count
    size = emission.states
    if lanes > 1:
        return [StatePart(j, 1) for j in range(size)]
    by = 2 if own <= 4 else 4
    pieces = [StatePart(j, min(by, own - j)) for j in range(0, own, by)]
    for first in (own, own + n):
        pieces += [StatePart(first + j, min(GROUP, n - j)) for j in range(0, n, GROUP)]
    rest = size - own - 2 * n
    return [*pieces, *([StatePart(own + 2 * n, rest)] if rest else [])]


def step_text(
    emission: Emission, a: np.ndarray, b: np.ndarray, c: np.ndarray, lanes: int = 1
) -> str:
    """Return LLVM IR of ``step(c, b, y, k, trial, begin, length)``, which takes one step.

    k is the slope at the step's beginning, and the state at its end is written to trial. In lanes,
    it is ``step(c, b, t, y, k, trial)``, with begin and length of each run at t.

    Args:
        emission: emitter of the model's functions.
        a, b, c: Butcher tableau, shapes (s, s), (s,), (s,).
        lanes: number of runs computed together.
    """
    slope = _slope_function(emission, lanes)
    step = _step_function(emission, a, b, c, lanes)
    declared = sorted(slope.declared | step.declared)
    return "\n".join([*declared, slope.text(), step.text()]) + "\n"


class _Slope(Function):
    """Function from a state to its slope, both as values, which each stage calls."""

    def __init__(self, emission: Emission, lanes: int) -> None:
        pointers = [CONSTANTS, BRANCHES]
        super().__init__("slope_of", pointers, Shape(emission.model.count, lanes))
        self.pieces = pieces_of(emission, lanes)
        self.kinds = [kind(piece.width * lanes) for piece in self.pieces]
        self.returned = ""

    @property
    def result(self) -> str:
        return "{" + ", ".join(self.kinds) + "}"

    def text(self) -> str:
        lanes = self.shape.lanes
        arguments = [f"ptr noalias readonly %{name}" for name in self.pointers]
        arguments += [f"{kind(lanes)} %time"]
        arguments += [f"{of} %y{j}" for j, of in enumerate(self.kinds)]
        body = "\n".join(f"  {line}" for line in [*self.lines, self.returned])
        head = f"define internal fastcc {self.result} @{self.name}({', '.join(arguments)})"
        return f"{head} noinline nounwind {{\n{body}\n}}\n"


def _slope_function(emission: Emission, lanes: int) -> _Slope:
    into, model = _Slope(emission, lanes), emission.model
    own, n = model.states, model.count
    names = {j: f"deck[{j}]" for j in range(own)}
    names |= {own + 2 * n + k: name for k, name in enumerate(("psi", "omega", "integral"))}
    bound: dict[str, list[str]] = {"time": ["%time"], "theta": [], "rate": []}
    for at, piece in enumerate(into.pieces):
        if own <= piece.first < own + 2 * n:
            bound["theta" if piece.first < own + n else "rate"].append(f"%y{at}")
            continue
        for k in range(piece.width):
            if piece.first + k in names:
                value = f"%y{at}"
                if piece.width > 1:
                    value = into.put(f"extractelement {into.kinds[at]} {value}, i32 {k}")
                bound[names[piece.first + k]] = [value]
    body = Body(into, emission.places, emission.known, bound)
    roots = emission.roots["slope"]
    deck, balls, rest = roots[:own], roots[own : own + 2], roots[own + 2 :]
    single = {j: x for j, x in enumerate(deck)} | {own + 2 * n + k: x for k, x in enumerate(rest)}
    each = {own: body.each(balls[0]), own + n: body.each(balls[1])} if n else {}
    by_ball = 1 if lanes > 1 else GROUP
    made = "poison"
    for at, piece in enumerate(into.pieces):
        if own <= piece.first < own + 2 * n:
            first = own if piece.first < own + n else own + n
            value = each[first][(piece.first - first) // by_ball]
        else:
            value = _packed(into, body, [single[piece.first + k] for k in range(piece.width)])
        made = into.put(f"insertvalue {into.result} {made}, {into.kinds[at]} {value}, {at}")
    into.returned = f"ret {into.result} {made}"
    return into


def _packed(into: Function, body: Body, roots: Sequence[Expression]) -> str:
    """Return one vector of several numbers."""
    values, width = [body.values(x)[0] for x in roots], len(roots)
    if width == 1:
        return values[0]
    made = "poison"
    for k, value in enumerate(values):
        made = into.put(f"insertelement {kind(width)} {made}, double {value}, i32 {k}")
    return made


def _step_function(
    emission: Emission, a: np.ndarray, b: np.ndarray, c: np.ndarray, lanes: int
) -> Function:
    slope = _Slope(emission, lanes)
    pieces, kinds = slope.pieces, slope.kinds
    shape = Shape(emission.model.count, lanes)
    if lanes > 1:
        into = Function("step", [CONSTANTS, BRANCHES, TIMES, "y", "k", "trial"], shape)
        begin, length = (into.load(MemorySlot(TIMES, at), 0, 1) for at in (0, 1))
    else:
        numbers = ["begin", "length"]
        into = Function("step", [CONSTANTS, BRANCHES, "y", "k", "trial"], shape, numbers)
        begin, length = "%begin", "%length"
    state = [into.load(MemorySlot("y", p.first), 0, p.width) for p in pieces]
    slopes = [[into.load(MemorySlot("k", p.first), 0, p.width) for p in pieces]]

    def combined(row: np.ndarray) -> list[str]:
        """Return the state plus ``length`` times the sum of weighted slopes."""
        found = []
        for at, piece in enumerate(pieces):
            width = piece.width * lanes
            total = ""
            for weight, each in zip(row.tolist(), slopes, strict=False):
                if weight == 0.0:
                    continue
                factor = literal(weight, width)
                if total:
                    total = into.call("fma", width, factor, each[at], total)
                else:
                    total = into.put(f"fmul {kinds[at]} {factor}, {each[at]}")
            by = length if width == lanes else into.widened(length, width)
            found.append(into.call("fma", width, by, total, state[at]))
        return found

    for stage in range(1, len(b)):
        trial = combined(a[stage])
        time = into.call("fma", lanes, literal(float(c[stage]), lanes), length, begin)
        arguments = [f"ptr %{CONSTANTS}", f"ptr %{BRANCHES}", f"{kind(lanes)} {time}"]
        arguments += [f"{of} {value}" for of, value in zip(kinds, trial, strict=True)]
        called = into.put(f"call fastcc {slope.result} @slope_of({', '.join(arguments)})")
        slopes.append(
            [into.put(f"extractvalue {slope.result} {called}, {at}") for at in range(len(pieces))]
        )
    for piece, value in zip(pieces, combined(b), strict=True):
        into.store(value, MemorySlot("trial", piece.first), 0, piece.width * lanes)
    return into

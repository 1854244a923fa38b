"""Emit steps of explicit Runge-Kutta methods and of extrapolation, with the state in registers.

All stages call one function that takes a state and returns a slope as values. So the stages need no
arrays in memory, and the code of the equations exists only once. All stages read the same branches
b, so that a step is smooth even if it goes beyond an event.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.engine.kernels.emission import BRANCHES, CONSTANTS, TIMES, Emission
from ab_sim.tracing import Expression
from ab_sim.tracing.functions import GROUP
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, kind, literal


class Tableau(NamedTuple):
    """Butcher tableau of an explicit method."""

    a: np.ndarray
    """Stage weights, shape (s, s), strictly lower triangular."""
    b: np.ndarray
    """Weights of the stages in the step, shape (s,)."""
    c: np.ndarray
    """Stage times as fractions of the step, shape (s,)."""

    def stages(self) -> list[tuple[float, list[tuple[float, int]]]]:
        """Return the stages after the first, then the step's end, as all generated code has them.

        Each one has its time as a fraction of the step, and the weights of earlier stages' slopes
        with the numbers of these stages. Weights of zero are left out.
        """
        times, rows = [*self.c[1:].tolist(), 1.0], [*self.a[1:].tolist(), self.b.tolist()]
        rows_at = zip(times, rows, strict=True)
        return [(time, [(w, k) for k, w in enumerate(row) if w != 0.0]) for time, row in rows_at]


class Extrapolation(NamedTuple):
    """Extrapolation of Euler's method in n equal parts to infinite n, with implicit drag."""

    divisions: tuple[int, ...]
    """Numbers n of parts, increasing."""

    @property
    def weights(self) -> list[float]:
        """Weight of each n: value at 0 of Lagrange's polynomial in 1/n, as by Aitken-Neville."""
        return [math.prod(n / (n - k) for k in self.divisions if k != n) for n in self.divisions]


EMITTED = (Tableau, Extrapolation)
"""Classes of the methods whose steps are emitted here."""


class StatePart(NamedTuple):
    """Adjacent numbers of a state that are held in one vector."""

    first: int
    width: int
    """Number of states in the vector; in lanes always one."""


def _pieces_of(emission: Emission, lanes: int) -> list[StatePart]:
    """Return the division of a state into vectors: deck's states by 2 or 4, balls' by groups."""
    model = emission.model
    deck_states, n = model.states, model.count
    size = emission.states
    if lanes > 1:
        return [StatePart(j, 1) for j in range(size)]
    by = 2 if deck_states <= 4 else 4
    pieces = [StatePart(j, min(by, deck_states - j)) for j in range(0, deck_states, by)]
    for first in (deck_states, deck_states + n):
        pieces += [StatePart(first + j, min(GROUP, n - j)) for j in range(0, n, GROUP)]
    rest = size - deck_states - 2 * n
    return [*pieces, *([StatePart(deck_states + 2 * n, rest)] if rest else [])]


def step_text(
    emission: Emission, method: Tableau | Extrapolation, lanes: int = 1, parts: int = 1
) -> str:
    """Return LLVM IR of ``step(c, b, y, k, trial, begin, length)``, which takes one step.

    k is the slope at the step's beginning, and the state at its end is written to trial. In lanes,
    it is ``step(c, b, t, y, k, trial)``, with begin and length of each run at t.

    Parameters
    ----------
    emission
        Emitter of the model's functions.
    method
        Method of the step.
    lanes
        Number of runs computed together.
    parts
        Number of equal parts into which the step is divided.
    """
    if isinstance(method, Extrapolation):
        step = _Step(emission, lanes, parts, emission.implicit_slope(), ahead=True)
        return step.text(_extrapolated(step, method))
    step = _Step(emission, lanes, parts, emission.roots["slope"])
    return step.text(_explicit(step, method))


def _explicit(step: "_Step", tableau: Tableau) -> list[str]:
    """Emit the stages of an explicit method; return the state at the end."""
    # Only the first part's initial slope is known, so each part evaluates its own.
    slopes = [step.loaded("k") if step.parts == 1 else step.slope(step.state, step.time(0.0))]

    def combined(terms: Sequence[tuple[float, int]]) -> list[str]:
        """Return the state plus ``length`` times the sum of weighted slopes."""
        total: list[str] = []
        for weight, stage in terms:
            total = step.sums(step.literal(weight), slopes[stage], total)
        return step.sums(step.length, total, step.state)

    *stages, (_, end) = tableau.stages()
    for share, terms in stages:
        slopes.append(step.slope(combined(terms), step.time(share)))
    return combined(end)


def _extrapolated(step: "_Step", method: Extrapolation) -> list[str]:
    """Emit the extrapolated step; return the state at the end.

    Each part evaluates drag at its end and all else at its beginning, so k is not used. The change
    of the state is extrapolated, as it is small relative to the state and so rounds less.
    """
    total: list[str] = []
    for n, weight in zip(method.divisions, method.weights, strict=True):
        part = step.times(step.literal(1.0 / n), step.length)
        change: list[str] = []
        for k in range(n):
            at = step.sums(step.literal(1.0), change, step.state) if change else step.state
            change = step.sums(part, step.slope(at, step.time(k / n), part), change)
        total = step.sums(step.literal(weight), change, total)
    return step.sums(step.literal(1.0), total, step.state)


class _Step:
    """Function of a step, with the state in registers and calls of the slope at trial states.

    Parameters
    ----------
    emission
        Emitter of the model's functions.
    lanes
        Number of runs computed together.
    parts
        Number of equal parts of the step; a loop repeats the method for each.
    roots
        Rates of change of the states.
    ahead
        True if the rates take the input ``ahead``.
    """

    def __init__(
        self,
        emission: Emission,
        lanes: int,
        parts: int,
        roots: Sequence[Expression],
        ahead: bool = False,
    ) -> None:
        self._lanes, self.parts = lanes, parts
        self._slope = _slope_function(emission, lanes, roots, ahead)
        shape = Shape(emission.model.count, lanes)
        if lanes > 1:
            self.into = Function("step", [CONSTANTS, BRANCHES, TIMES, "y", "k", "trial"], shape)
            places = MemorySlot(TIMES, 0), MemorySlot(TIMES, 1)
            self.begin, self.length = (self.into.load(place, 0, 1) for place in places)
        else:
            pointers = [CONSTANTS, BRANCHES, "y", "k", "trial"]
            self.into = Function("step", pointers, shape, ["begin", "length"])
            self.begin, self.length = "%begin", "%length"
        self.state = self.loaded("y")
        if parts > 1:
            self._enter_loop()

    def _enter_loop(self) -> None:
        """Begin the loop over parts, which passes on the number of finished parts and the state."""
        self._start, self.state = self.state, [f"%s{at}" for at in range(len(self.state))]
        self.length = self.times(self.literal(1.0 / self.parts), self.length)
        self.into.lines += ["br label %part", "part:"]
        self._head = len(self.into.lines)
        self.begin = self.into.call("fma", self._lanes, "%done", self.length, self.begin)

    def _end_loop(self, end: Sequence[str]) -> None:
        """End the loop; the phi nodes at its head need the state at its end."""
        lanes, into = self._lanes, self.into
        passed = [("%done", kind(lanes), literal(0.0, lanes), "%more")]
        passed += zip(self.state, self._slope.kinds, self._start, end, strict=True)
        into.lines[self._head : self._head] = [
            f"{name} = phi {of} [{first}, %0], [{next_one}, %part]"
            for name, of, first, next_one in passed
        ]
        into.lines.append(f"%more = fadd {kind(lanes)} %done, {literal(1.0, lanes)}")
        count = into.put(f"extractelement {kind(lanes)} %more, i32 0") if lanes > 1 else "%more"
        again = into.put(f"fcmp olt double {count}, {literal(float(self.parts), 1)}")
        into.lines += [f"br i1 {again}, label %part, label %end", "end:"]

    def loaded(self, pointer: str) -> list[str]:
        """Load a vector of states from a pointer."""
        pieces = self._slope.pieces
        return [self.into.load(MemorySlot(pointer, p.first), 0, p.width) for p in pieces]

    def literal(self, value: float) -> str:
        """Return a constant in all lanes."""
        return literal(value, self._lanes)

    def times(self, one: str, other: str) -> str:
        """Return the product of two numbers, one per lane."""
        return self.into.put(f"fmul {kind(self._lanes)} {one}, {other}")

    def time(self, share: float) -> str:
        """Return the time after a fraction of the step."""
        return self.into.call("fma", self._lanes, self.literal(share), self.length, self.begin)

    def sums(self, factor: str, values: Sequence[str], added: Sequence[str]) -> list[str]:
        """Return ``factor`` times ``values`` plus ``added``, which may be empty."""
        totals = []
        for at, piece in enumerate(self._slope.pieces):
            width, of = piece.width * self._lanes, self._slope.kinds[at]
            by = self._wide(factor, width)
            if added:
                totals.append(self.into.call("fma", width, by, values[at], added[at]))
            else:
                totals.append(self.into.put(f"fmul {of} {by}, {values[at]}"))
        return totals

    def slope(self, trial: Sequence[str], *numbers: str) -> list[str]:
        """Call the slope at a trial state; ``numbers`` are the time and, if taken, ``ahead``."""
        slope, of = self._slope, kind(self._lanes)
        arguments = [f"ptr %{CONSTANTS}", f"ptr %{BRANCHES}", *(f"{of} {x}" for x in numbers)]
        arguments += [
            f"{type_name} {value}" for type_name, value in zip(slope.kinds, trial, strict=True)
        ]
        called = self.into.put(f"call fastcc {slope.result} @slope_of({', '.join(arguments)})")
        return [
            self.into.put(f"extractvalue {slope.result} {called}, {at}")
            for at in range(len(slope.pieces))
        ]

    def text(self, end: Sequence[str]) -> str:
        """Complete the step and return its LLVM IR; ``end`` are the values of the final state."""
        if self.parts > 1:
            self._end_loop(end)
        for piece, value in zip(self._slope.pieces, end, strict=True):
            self.into.store(value, MemorySlot("trial", piece.first), 0, piece.width * self._lanes)
        declared = sorted(self._slope.declared | self.into.declared)
        return "\n".join([*declared, self._slope.text(), self.into.text()]) + "\n"

    def _wide(self, factor: str, width: int) -> str:
        """Return a factor as a vector of ``width`` equal numbers."""
        if width == self._lanes:
            return factor
        if factor.startswith("0x"):  # a constant
            return f"splat (double {factor})"
        return self.into.widened(factor, width)


class _Slope(Function):
    """Function from a state to its slope, both as values, which each stage calls."""

    def __init__(self, emission: Emission, lanes: int, times: Sequence[str]) -> None:
        pointers = [CONSTANTS, BRANCHES]
        self._times = times
        super().__init__("slope_of", pointers, Shape(emission.model.count, lanes))
        self.pieces = _pieces_of(emission, lanes)
        self.kinds = [kind(piece.width * lanes) for piece in self.pieces]
        self.returned = ""

    @property
    def result(self) -> str:
        return "{" + ", ".join(self.kinds) + "}"

    def text(self) -> str:
        lanes = self.shape.lanes
        arguments = [f"ptr noalias readonly %{name}" for name in self.pointers]
        arguments += [f"{kind(lanes)} %{name}" for name in self._times]
        arguments += [f"{of} %y{j}" for j, of in enumerate(self.kinds)]
        body = "\n".join(f"  {line}" for line in [*self.lines, self.returned])
        head = f"define internal fastcc {self.result} @{self.name}({', '.join(arguments)})"
        return f"{head} noinline nounwind {{\n{body}\n}}\n"


def _slope_function(
    emission: Emission, lanes: int, roots: Sequence[Expression], ahead: bool
) -> _Slope:
    """Emit the function from a state to its slope; the arguments are those of ``_Step``.

    Numbers of the balls stay in vectors of GROUP balls. The deck's are taken out of their vectors,
    because its formulas treat each of them differently.
    """
    times = ["time", "ahead"] if ahead else ["time"]
    into, model = _Slope(emission, lanes, times), emission.model
    deck_states, n = model.states, model.count
    names = {j: f"deck[{j}]" for j in range(deck_states)}
    names |= {deck_states + 2 * n + k: name for k, name in enumerate(("psi", "omega", "integral"))}
    bound = {name: [f"%{name}"] for name in times} | {"theta": [], "rate": []}
    for at, piece in enumerate(into.pieces):
        if deck_states <= piece.first < deck_states + 2 * n:
            bound["theta" if piece.first < deck_states + n else "rate"].append(f"%y{at}")
            continue
        for k in range(piece.width):
            if piece.first + k in names:
                value = f"%y{at}"
                if piece.width > 1:
                    value = into.put(f"extractelement {into.kinds[at]} {value}, i32 {k}")
                bound[names[piece.first + k]] = [value]
    body = Body(into, emission.places, emission.derived_slots, bound)
    deck, balls, rest = (
        roots[:deck_states],
        roots[deck_states : deck_states + 2],
        roots[deck_states + 2 :],
    )
    single = {j: x for j, x in enumerate(deck)} | {
        deck_states + 2 * n + k: x for k, x in enumerate(rest)
    }
    ball_values = (
        {deck_states: body.each(balls[0]), deck_states + n: body.each(balls[1])} if n else {}
    )
    by_ball = 1 if lanes > 1 else GROUP
    vector = "poison"
    for at, piece in enumerate(into.pieces):
        if deck_states <= piece.first < deck_states + 2 * n:
            first = deck_states if piece.first < deck_states + n else deck_states + n
            value = ball_values[first][(piece.first - first) // by_ball]
        else:
            value = _packed(into, body, [single[piece.first + k] for k in range(piece.width)])
        vector = into.put(f"insertvalue {into.result} {vector}, {into.kinds[at]} {value}, {at}")
    into.returned = f"ret {into.result} {vector}"
    return into


def _packed(into: Function, body: Body, roots: Sequence[Expression]) -> str:
    """Emit several numbers, and return the name of one vector that holds them."""
    values, width = [body.values(x)[0] for x in roots], len(roots)
    if width == 1:
        return values[0]
    vector = "poison"
    for k, value in enumerate(values):
        vector = into.put(f"insertelement {kind(width)} {vector}, double {value}, i32 {k}")
    return vector

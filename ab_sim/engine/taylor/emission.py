"""Machine code of a Taylor step, for one run or for several in lanes.

The length of a step follows from its last two coefficients. It is the largest at which both terms
are within the tolerance: Jorba and Zou (2005), Exp. Math. 14, 99-117, 3.2. Logarithms and powers
are accurate to a few thousandths, which is enough for a length, and give the same bits on every
machine, in lanes or not.
"""

from collections.abc import Sequence

from ab_sim.engine.kernels.emission import Emission
from ab_sim.engine.kernels.model import OF_EACH_BALL
from ab_sim.engine.stepping.emitted import normalised, unwound
from ab_sim.engine.taylor.clock import (
    BEGIN,
    COUNT_DUE,
    COUNT_LEFT,
    END,
    INPUTS,
    LOCAL,
    LOG_TOLERANCE,
    RESTART,
    SOUND,
    SOUND_STEPS,
    STEP,
    TO,
    ClockLines,
    due_samples,
    end_of_step,
    recorded,
    soundness,
)
from ab_sim.engine.taylor.series import squared_size, state_coefficients
from ab_sim.model.equations.sums import over_balls
from ab_sim.tracing import Expression, Level, lowered, where
from ab_sim.tracing.llvm_text import (
    Body,
    Function,
    MemorySlot,
    StoredRoot,
    kind,
    literal,
    store_lines,
)

SHORTEST, LONGEST = -60.0, 10.0
"""Base-2 logarithms of the shortest and longest length [s]."""
_FRACTION, _ONE = 0xFFFFFFFFFFFFF, 0x3FF0000000000000
"""Bit mask of a double's fraction, and the bits of 1.0."""


def step_length(into: Function, log_tolerance: str, squares: dict[int, str]) -> str:
    """Emit the computation of a step's length [s], and return the result's name.

    Parameters
    ----------
    into
        Function to extend.
    log_tolerance
        Name of the tolerance's base-2 logarithm.
    squares
        Names of the squared norms of coefficients, by order.
    """
    lanes = into.shape.lanes
    of, logarithms = kind(lanes), []
    # |coefficient| length^order = tolerance, solved for the length in logarithms.
    for order, square in squares.items():
        half = literal(-0.5, lanes)
        missing = into.call("fma", lanes, half, _log2(into, square), log_tolerance)
        logarithms.append(into.put(f"fmul {of} {missing}, {literal(1.0 / order, lanes)}"))
    least = logarithms[0]
    for logarithm in logarithms[1:]:
        least = _less(into, logarithm, least)
    return _exp2(into, least)


def _log2(into: Function, x: str) -> str:
    """Emit the base-2 logarithm of a number that is not negative; for 0 it is about -1023."""
    lanes = into.shape.lanes
    of, bits_of = kind(lanes), kind(lanes, "i64")
    bits = into.put(f"bitcast {of} {x} to {bits_of}")
    exponent = into.put(f"lshr {bits_of} {bits}, {_whole(52, lanes)}")
    exponent = into.put(f"sub {bits_of} {exponent}, {_whole(1023, lanes)}")
    exponent = into.put(f"sitofp {bits_of} {exponent} to {of}")
    fraction = into.put(f"and {bits_of} {bits}, {_whole(_FRACTION, lanes)}")
    fraction = into.put(f"or {bits_of} {fraction}, {_whole(_ONE, lanes)}")
    fraction = into.put(f"bitcast {bits_of} {fraction} to {of}")
    return into.put(
        f"fadd {of} {exponent}, {_quadratic(into, fraction, -0.33582878, 2.0, -1.65871022)}"
    )


def _exp2(into: Function, x: str) -> str:
    """Emit 2 to the power x, with x clamped to SHORTEST .. LONGEST; NaN counts as LONGEST."""
    lanes = into.shape.lanes
    of, bits_of = kind(lanes), kind(lanes, "i64")
    x = _less(into, x, literal(LONGEST, lanes))
    above = into.put(f"fcmp ogt {of} {x}, {literal(SHORTEST, lanes)}")
    x = _chosen(into, above, x, literal(SHORTEST, lanes))
    whole = into.call("floor", lanes, x)
    rest = into.put(f"fsub {of} {x}, {whole}")
    power = into.put(f"fptosi {of} {whole} to {bits_of}")
    power = into.put(f"add {bits_of} {power}, {_whole(1023, lanes)}")
    power = into.put(f"shl {bits_of} {power}, {_whole(52, lanes)}")
    power = into.put(f"bitcast {bits_of} {power} to {of}")
    return into.put(f"fmul {of} {power}, {_quadratic(into, rest, 0.33977, 0.65723, 1.00249)}")


def _quadratic(into: Function, x: str, a: float, b: float, c: float) -> str:
    """Emit a x^2 + b x + c."""
    lanes = into.shape.lanes
    slope = into.call("fma", lanes, literal(a, lanes), x, literal(b, lanes))
    return into.call("fma", lanes, slope, x, literal(c, lanes))


def _less(into: Function, a: str, b: str) -> str:
    """Emit the smaller of two numbers; b if a is NaN."""
    lanes = into.shape.lanes
    return _chosen(into, into.put(f"fcmp olt {kind(lanes)} {a}, {b}"), a, b)


def _chosen(into: Function, which: str, a: str, b: str) -> str:
    """Emit a selection: ``a`` where the condition ``which`` holds, else ``b``."""
    lanes = into.shape.lanes
    of = kind(lanes)
    return into.put(f"select {kind(lanes, 'i1')} {which}, {of} {a}, {of} {b}")


def _whole(value: int, lanes: int) -> str:
    """Return an int constant for all lanes."""
    return f"splat (i64 {value})" if lanes > 1 else str(value)


class TaylorEmission:
    """Functions that a driver of Taylor steps calls: see ``ab_sim.engine.taylor``.

    Parameters
    ----------
    emission
        Emission of the equations.
    order
        Order of the series.
    """

    def __init__(self, emission: Emission, order: int) -> None:
        self._emission, self._order, self._model = emission, order, emission.model
        self._clock = ClockLines(emission.model.graph)
        self.size = (order + 1) * emission.states
        """Count of numbers in a series."""

    def functions(self, lanes: int) -> list[Function]:
        """Emit all functions for ``lanes`` runs side by side."""
        functions = [
            self.coefficients(lanes),
            self.move(lanes),
            self.mark(lanes),
            self.sample(lanes),
        ]
        if lanes > 1:
            functions += [self.record(lanes, dense) for dense in (False, True)]
        return functions

    def coefficients(self, lanes: int) -> Function:
        """Emit ``coefficients(c, b, t, y, series)``: the series, and the end of the step."""
        into, body = self._function("coefficients", ["y", "series"], lanes)
        body.places |= self._emission.state_places("y")
        # The equations are evaluated at the time at which the series begins.
        body.places[INPUTS[LOCAL]] = MemorySlot("t", BEGIN)
        series = state_coefficients(self._model, self._order)
        orders = (self._order, self._order - 1)
        sizes = [squared_size(self._model, series, k) for k in orders]
        flat = [coefficient for coefficients in series for coefficient in coefficients]
        *lowered_, high, low = lowered([*flat, *sizes])
        count = self._order + 1
        body.store_all(
            [
                StoredRoot(lowered_[state * count + k], self._slot(name, k), name in OF_EACH_BALL)
                for k in range(count)
                for state, name in enumerate(self._model.state_names)
                if self._model.count or name not in OF_EACH_BALL
            ]
        )
        squares = {k: body.values(x)[0] for k, x in zip(orders, (high, low), strict=True)}
        length = step_length(into, body.values(self._clock[LOG_TOLERANCE])[0], squares)
        behind = Body(into, body.places, bound={"clock.step_length": [length]})
        end = end_of_step(self._clock, self._model.graph.input("clock.step_length"))
        behind.store(end, MemorySlot("t", END))
        return into

    def move(self, lanes: int) -> Function:
        """Emit ``move(c, b, t, series, reached, y, turns)``."""
        model, n, input_ = self._model, self._model.count, self._model.graph.input
        into, body = self._function("move", ["series", "reached", "y", "turns"], lanes)
        on_series = self._sums(self._clock[TO] - self._clock[BEGIN], body)
        fresh, restarts = self._named("reached", body), self._clock[RESTART] > 0.0
        state = [where(restarts, a, b) for a, b in zip(fresh, on_series, strict=True)]
        quaternion = type(model.deck).UNIT_AT
        if quaternion >= 0:
            unit = slice(quaternion, quaternion + 4)
            state[unit], _ = normalised(state[unit])
        results = state
        if n:
            turn, state[model.states] = unwound(state[model.states])
            body.places["turns"] = MemorySlot("turns", 0)
            results = [*state, input_("turns", per_ball=True) + turn]
        results = lowered(results)
        # All values are read before any is written: outputs may overwrite inputs.
        for x in (*results, self._clock[TO]):
            body.values(x)
        self._emission.store_slope(body, results[: len(state)], "y")
        if n:
            body.store(results[-1], MemorySlot("turns", 0))
        body.store(self._clock[TO], MemorySlot("t", BEGIN))
        body.store(model.lifted(0.0), MemorySlot("t", RESTART))
        return into

    def mark(self, lanes: int) -> Function:
        """Emit ``mark(c, b, t, status)``, which finds runs with a sample due in this step."""
        into, body = self._function("mark", ["status"], lanes)
        due = due_samples(self._clock)
        for x in (*due.lines.values(), due.due, due.left):
            body.values(x)
        for line, x in due.lines.items():
            body.store(x, MemorySlot("t", line))
        body.store(due.due, MemorySlot("status", COUNT_DUE))
        body.store(due.left, MemorySlot("status", COUNT_LEFT))
        return into

    def sample(self, lanes: int) -> Function:
        """Emit ``sample(c, b, t, series, turns, bounds, reached, status, row)``."""
        pointers = ["series", "turns", "bounds", "reached", "status", "row"]
        into, body = self._function("sample", pointers, lanes)
        sums = lowered(self._sums(self._clock[LOCAL] - self._clock[BEGIN], body))
        self._emission.store_slope(body, sums, "reached")
        self._store_soundness(body, sums)
        values = (body.values(x) for x in sums)
        bound = dict(zip(self._model.state_names, values, strict=True))
        body.places["turns"] = MemorySlot("turns", 0)
        behind, emission = (
            Body(into, body.places, self._emission.derived_slots, bound),
            self._emission,
        )
        emission.store_columns(
            behind, "row", *emission.row(turned=True), emission.roots["torque"][0]
        )
        return into

    def record(self, lanes: int, dense: bool) -> Function:
        """Emit ``record(c, b, t, row, samples, nowhere, channel)``, for lanes.

        With ``dense``, emit ``record_dense``, for samples whose channels are contiguous.
        """
        channels, pointers = self._emission.row_channels, ["row", "samples", "nowhere"]
        into, body = self._function("record_dense" if dense else "record", pointers, lanes)
        into.numbers = ["channel"]
        apart = into.put("fptosi double %channel to i64")
        is_one, place, steps = recorded(self._clock)
        seconds = steps * self._clock[STEP]
        head = [body.values(x)[0] for x in (steps, seconds)]
        columns = [*head, *(into.load(MemorySlot("row", k), 0, 1) for k in range(channels))]
        of_ints = kind(lanes, "i64")
        at = into.put(f"fptosi {kind(lanes)} {body.values(place)[0]} to {of_ints}")
        chosen = into.put(f"fcmp ogt {kind(lanes)} {body.values(is_one)[0]}, zeroinitializer")
        pointers, apart_each = [], []
        # A lane without a sample to record writes to ``nowhere``, so that no branch is needed.
        for lane in range(lanes):
            one = into.put(f"extractelement {of_ints} {at}, i32 {lane}")
            here = into.put(f"getelementptr double, ptr %samples, i64 {one}")
            if_one = into.put(f"extractelement {kind(lanes, 'i1')} {chosen}, i32 {lane}")
            pointers.append(into.put(f"select i1 {if_one}, ptr {here}, ptr %nowhere"))
            if not dense:
                apart_each.append(into.put(f"select i1 {if_one}, i64 {apart}, i64 0"))
        if dense:
            store_lines(into, columns, pointers)
            return into
        for lane, (pointer, between) in enumerate(zip(pointers, apart_each, strict=True)):
            for column in columns:
                number = into.put(f"extractelement {kind(lanes)} {column}, i32 {lane}")
                into.lines.append(f"store double {number}, ptr {pointer}, align 8")
                pointer = into.put(f"getelementptr double, ptr {pointer}, i64 {between}")
        return into

    def _function(self, name: str, pointers: Sequence[str], lanes: int) -> tuple[Function, Body]:
        """Return a new function with the arguments c, b, t and ``pointers``, and its empty body."""
        return self._emission.function(name, pointers, INPUTS, lanes=lanes, times=True)

    def _store_soundness(self, body: Body, state: Sequence[Expression]) -> None:
        """Emit stores of flags and counts that show whether the state is within its bounds."""
        inside = self._model.lifted(1.0)
        for x, bound in zip(state, self._named("bounds", body), strict=True):
            beyond = where(abs(x) < bound, 0.0, self._model.lifted(1.0))
            if x.each:
                beyond = over_balls(self._model.count, beyond)
            inside = inside - beyond
        names = {"status.sound": SOUND, "status.steps": SOUND_STEPS}
        body.places |= {name: MemorySlot("status", line) for name, line in names.items()}
        sound, steps = (self._model.graph.input(name, Level.TIME) for name in names)
        soundness_ = soundness(self._clock, sound, steps, self._clock.flag(inside > 0.5))
        for x in soundness_.values():
            body.values(x)
        for line, x in soundness_.items():
            body.store(x, MemorySlot("status", line))

    def _slot(self, name: str, k: int) -> MemorySlot:
        """Return the place of a state's coefficient k in a series; balls' are contiguous."""
        first = self._emission.state_places("series")[name].at
        between = self._model.count if name in OF_EACH_BALL else 1
        return MemorySlot("series", first * (self._order + 1) + k * between)

    def _sums(self, offset: Expression, body: Body) -> list[Expression]:
        """Return the states at ``offset`` from a series' beginning.

        Even and odd powers are summed separately by Horner's scheme: two shorter chains of
        dependent operations instead of one.
        """
        input_, totals, square = self._model.graph.input, [], offset * offset
        for name in self._model.state_names:
            series = []
            for k in range(self._order + 1):
                series.append(input_(f"{name}.{k}", per_ball=name in OF_EACH_BALL))
                body.places[f"{name}.{k}"] = self._slot(name, k)
            even, odd = (_horner(square, series[first::2]) for first in (0, 1))
            totals.append(offset * odd + even)
        return totals

    def _named(self, pointer: str, body: Body) -> list[Expression]:
        """Return inputs for the states stored at a pointer; ``body`` learns where they are."""
        input_, named = self._model.graph.input, []
        for name, place in self._emission.state_places(pointer).items():
            body.places[f"{pointer}.{name}"] = place
            named.append(input_(f"{pointer}.{name}", per_ball=name in OF_EACH_BALL))
        return named


def _horner(x: Expression, coefficients: Sequence[Expression]) -> Expression:
    """Return the polynomial of x from ``coefficients``, the constant one first."""
    total = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        total = x * total + coefficient
    return total

"""A Taylor step as machine code, of one run or of several in lanes."""

from collections.abc import Sequence

from ab_sim.equations.sums import over_balls
from ab_sim.kernels.emission import Emission
from ab_sim.stepping.settle import normalised, unwound
from ab_sim.taylor.series import squared_size, state_coefficients
from ab_sim.taylor.step_length import step_length
from ab_sim.tracing import Expression, Level, lowered, where
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot


class TaylorEmission:
    """Functions that a driver of Taylor steps calls: see ``ab_sim.taylor``.

    Args:
        emission: of the equations.
        order: of the series.
    """

    def __init__(self, emission: Emission, order: int) -> None:
        self._emission, self._order, self._model = emission, order, emission.model
        self.size = (order + 1) * emission.states
        """Numbers of a series."""

    def functions(self, lanes: int) -> list[Function]:
        """All, of so many runs side by side."""
        return [self.coefficients(lanes), self.move(lanes), self.sample(lanes)]

    def coefficients(self, lanes: int) -> Function:
        """``coefficients(c, b, t, y, series, length)``."""
        emission, model = self._emission, self._model
        into, body = emission.function(
            *("coefficients", ["y", "series", "length"], ["time", "aim", "per_length"]),
            state="y",
            lanes=lanes,
            times=True,
        )
        series = state_coefficients(model, self._order)
        per_length = model.graph.input("per_length", Level.TIME)
        orders = (self._order, self._order - 1)
        sizes = [squared_size(model, series, k, per_length) for k in orders]
        flat = [each for coefficients in series for each in coefficients]
        *found, high, low = lowered([*flat, *sizes])
        count = self._order + 1
        for k in range(count):
            for state in range(len(series)):
                of_balls = self._first(state)[1]
                if model.count or not of_balls:
                    body.store(found[state * count + k], self._slot(state, k), each=of_balls)
        squares = {k: body.values(x)[0] for k, x in zip(orders, (high, low), strict=True)}
        aim = body.values(model.graph.input("aim", Level.TIME))[0]
        into.store(step_length(into, aim, squares), MemorySlot("length", 0), 0, lanes)
        return into

    def move(self, lanes: int) -> Function:
        """``move(c, b, t, series, reached, y, turns)``."""
        emission, model, n = self._emission, self._model, self._model.count
        given = model.graph.input
        into, body = emission.function(
            *("move", ["series", "reached", "y", "turns"]),
            ["begin", "aim", "per_length", "to", "anew"],
            lanes=lanes,
            times=True,
        )
        offset = given("to", Level.TIME) - given("begin", Level.TIME)
        on_series = self._sums(offset, body)
        fresh = self._named("reached", body)
        anew = given("anew", Level.TIME) > 0.0
        state = [where(anew, a, b) for a, b in zip(fresh, on_series, strict=True)]
        quaternion = type(model.deck).UNIT_AT
        if quaternion >= 0:
            unit = slice(quaternion, quaternion + 4)
            state[unit], _ = normalised(state[unit])
        results = state
        if n:
            turn, state[model.states] = unwound(state[model.states])
            body.places["turns"] = MemorySlot("turns", 0)
            results = [*state, given("turns", each=True) + turn]
        results = lowered(results)
        # All is read before anything is written.
        for x in results:
            body.values(x)
        emission.store_slope(body, results[: len(state)], "y")
        if n:
            body.store(results[-1], MemorySlot("turns", 0))
        return into

    def sample(self, lanes: int) -> Function:
        """``sample(c, b, t, series, turns, bounds, reached, inside, row)``."""
        emission, model = self._emission, self._model
        into, body = emission.function(
            *("sample", ["series", "turns", "bounds", "reached", "inside", "row"]),
            ["time", "profile_time", "begin"],
            lanes=lanes,
            times=True,
        )
        given = model.graph.input
        offset = given("time", Level.TIME) - given("begin", Level.TIME)
        sums = lowered(self._sums(offset, body))
        emission.store_slope(body, sums, "reached")
        self._store_inside(body, sums)
        bound = dict(zip(self._names, (body.values(x) for x in sums), strict=True))
        behind = Body(into, body.places, emission.known, bound)
        emission.store_row(behind, "row", turned=True)
        return into

    def _store_inside(self, body: Body, state: Sequence[Expression]) -> None:
        """Write 1 of a state within its bounds, else 0."""
        inside, graph = self._model.lifted(1.0), self._model.graph
        for x, bound in zip(state, self._named("bounds", body), strict=True):
            beyond = where(abs(x) < bound, 0.0, 1.0)
            if x.each or bound.each:
                beyond = over_balls(self._model.count, beyond)
            inside = inside - beyond
        body.store(where(inside > 0.5, 1.0, graph.constant(0.0)), MemorySlot("inside", 0))

    @property
    def _names(self) -> list[str]:
        """Of the inputs that a state is made of, in its order."""
        own, balance = self._model.states, self._model.has_energy_balance
        names = [*(f"deck[{j}]" for j in range(own)), "theta", "rate"]
        return [*names, *(["work", "loss"] if balance else [])]

    def _first(self, state: int) -> tuple[int, bool]:
        """Where a state lies in memory, or the first ball's; whether it is one of the balls'."""
        own, n = self._model.states, self._model.count
        if state < own:
            return state, False
        of_balls = state - own
        return (own + of_balls * n, True) if of_balls < 2 else (own + 2 * n + of_balls - 2, False)

    def _slot(self, state: int, k: int) -> MemorySlot:
        """Where coefficient k is in a series, of balls side by side."""
        first, of_balls = self._first(state)
        between = self._model.count if of_balls else 1
        return MemorySlot("series", first * (self._order + 1) + k * between)

    def _sums(self, offset: Expression, body: Body) -> list[Expression]:
        """States so long after a series' beginning: even and odd powers apart, from the last on."""
        given, found, square = self._model.graph.input, [], offset * offset
        for state, name in enumerate(self._names):
            each, series = self._first(state)[1], []
            for k in range(self._order + 1):
                series.append(given(f"{name}.{k}", each=each))
                body.places[f"{name}.{k}"] = self._slot(state, k)
            even, odd = (_horner(square, series[first::2]) for first in (0, 1))
            found.append(offset * odd + even)
        return found

    def _named(self, pointer: str, body: Body) -> list[Expression]:
        """States behind a pointer."""
        given, found = self._model.graph.input, []
        for state, name in enumerate(self._names):
            first, of_balls = self._first(state)
            body.places[f"{pointer}.{name}"] = MemorySlot(pointer, first)
            found.append(given(f"{pointer}.{name}", each=of_balls))
        return found


def _horner(x: Expression, coefficients: Sequence[Expression]) -> Expression:
    total = coefficients[-1]
    for each in reversed(coefficients[:-1]):
        total = x * total + each
    return total

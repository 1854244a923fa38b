"""States in a collocation step, and what is made of them, in LLVM's language: N at once."""

from collections.abc import Iterable, Sequence
from typing import TypeVar

from ab_sim.collocation.emission import (
    BOUNDS,
    FORCES,
    OPEN,
    OWN,
    STATE,
    STATES,
    TABLES,
    WEIGHTS,
    CollocationEmission,
    MemorySlots,
)
from ab_sim.collocation.run import INSIDE, PROFILE_TIME, STRIDE, TIME
from ab_sim.kernels.emission import TIMES
from ab_sim.kernels.model import OF_EACH_BALL
from ab_sim.tracing import Expression
from ab_sim.tracing.expression import rebuilt
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape
from ab_sim.tracing.lowering import mapped
from ab_sim.tracing.transposed import store_lines
from ab_sim.tracing.unrolled import unrolled

Item = TypeVar("Item")

TURNS, SAMPLES, NODES = "turns", "samples", "nodes"
"""Names of pointers."""


class LaneSampling:
    """Functions of states in lanes.

    Args:
        emission: of the scene's collocation.
    """

    def __init__(self, emission: CollocationEmission) -> None:
        self.of, self.model = emission, emission.model

    def functions(self) -> list[Function]:
        """All of them."""
        found = [self.sample(), self.rows()]
        return [*found, self.evaluate(), self.take_node()] if self.model.has_events else found

    def sample(self) -> Function:
        """``sample(c, b, own, tables, spindle, weights, bounds, y, f, states, begin, length)``."""
        of = self.of
        places = {**of.table_places(), **of.linear_places(), **of.weight_places()}
        states = of.emission.state_places(STATE)
        places |= {**states, **dict(of.row_places(FORCES, "f"))}
        for name, place in states.items():
            places[f"bound[{name}]"] = place._replace(pointer=BOUNDS)
        pointers = [OWN, TABLES, OPEN, WEIGHTS, BOUNDS, STATE, FORCES, STATES]
        into, body = of.function("sample", pointers, ["begin", "length"], places, [BOUNDS])
        targets = self._lines_of_states()
        of.store(body, of.lowered(of.steps.sample()), targets, {})
        return into

    def _lines_of_states(self) -> MemorySlots:
        """See ``run.Buffers.states``."""
        found = MemorySlots()
        for name, place in self.of.emission.state_places(STATE).items():
            found[name] = MemorySlot(STATES, STRIDE * place.at, STRIDE)
        for name, line in (("time", TIME), ("profile_time", PROFILE_TIME), ("inside", INSIDE)):
            found[name] = MemorySlot(STATES, STRIDE * (self.of.emission.states + line))
        return found

    def _of_states(
        self, name: str, pointers: Sequence[str], numbers: Sequence[str], times: Sequence[str]
    ) -> tuple[Function, Body]:
        """A function of states in lanes."""
        places: dict[str, MemorySlot] = self._lines_of_states()
        places |= {each: MemorySlot(TIMES, STRIDE * k) for k, each in enumerate(times)}
        places |= {"turns": MemorySlot(TURNS, 0), "turn": MemorySlot(TURNS, self.model.count)}
        return self.of.function(name, [TIMES, STATES, *pointers], numbers, places, [TURNS])

    def rows(self) -> Function:
        """``rows(c, b, times, states, turns, samples, width, count)``.

        Writes the first ``count`` of N samples, one at least, a row each, ``width`` numbers apart.
        """
        times = ("time", "profile_time")
        into, body = self._of_states("rows", [TURNS, SAMPLES], ["width", "count"], times)
        columns = self._row(body)
        width, count = (into.put(f"fptosi double %{name} to i64") for name in ("width", "count"))
        into.declared.add("declare i64 @llvm.smin.i64(i64, i64)")
        last, pointers = into.put(f"sub i64 {count}, 1"), []
        for lane in range(self.of.nodes):
            # Lanes behind the last one write where it does, and before it.
            line = into.put(f"call i64 @llvm.smin.i64(i64 {lane}, i64 {last})")
            offset = into.put(f"mul i64 {width}, {line}")
            pointers.append(into.put(f"getelementptr double, ptr %{SAMPLES}, i64 {offset}"))
        store_lines(into, columns, pointers)
        return into

    def _row(self, body: Body) -> list[str]:
        """A sample's row, as ``kernels.emission.Emission`` has it, with whole turns."""
        own, of_balls = self.of.emission.row(turned=True)
        own += self.of.emission.roots["torque"][: self.model.has_motor]
        if self.of.has_many_balls:
            return self._in_ball_order(body, own, of_balls)
        return self._as_in_row(
            [body.values(x)[0] for x in own],
            [body.each(x) for x in of_balls] if self.model.count else [],
        )

    def _as_in_row(self, own: Sequence[Item], of_balls: Iterable[Sequence[Item]]) -> list[Item]:
        """The spindle and the deck, each ball, and a motor's torque."""
        first = len(own) - self.model.has_motor
        each = [x for ball in zip(*of_balls, strict=True) for x in ball]
        return [*own[:first], *each, *own[first:]]

    def _in_ball_order(
        self, body: Body, own: Sequence[Expression], of_balls: Sequence[Expression]
    ) -> list[str]:
        """A row where not all balls' numbers are held at the same time."""
        known = self.of.emission.known

        def anew(x: Expression, args: Sequence[Expression]) -> Expression:
            if x.number not in known:
                return rebuilt(x, args)
            name = f"known.{x.number}"
            body.places[name] = known[x.number]
            return x.graph.input(name, x.level, x.each)

        columns = unrolled(mapped([*own, *of_balls], anew), self.model.count)
        alone, each = [x for (x,) in columns[: len(own)]], columns[len(own) :]
        for x in self.of.in_order(alone, {}):
            body.values(x)
        return [body.values(x)[0] for x in self._as_in_row(alone, each)]

    @property
    def columns(self) -> dict[str, int]:
        """What ``evaluate`` says of one node: how many numbers of each, in their order."""
        model, states = self.model, self.of.emission.states
        table = len(self.of.emission.roots.get("table", ())) * model.count
        return {"y": states, "slope": states, "x": model.unknowns, "motor": 3, "table": table}

    def evaluate(self) -> Function:
        """``evaluate(c, b, times, states, nodes)``: of each node a line of ``columns``."""
        into, body = self._of_states("evaluate", [NODES], [], ("time",))
        roots, model = self.of.emission.roots, self.model
        columns: list[str] = []
        for of_states in (model.state_inputs(), roots["slope"]):
            for name, x in zip(model.state_names, of_states, strict=True):
                if name not in OF_EACH_BALL:
                    columns += body.values(x)
                elif model.count:
                    columns += body.each(x)
        for x in (*roots["accelerations"], *roots["motor"]):
            columns += body.values(x)
        for x in roots["table"] if model.count else ():
            columns += body.each(x)
        width = sum(self.columns.values())
        pointers = [
            into.put(f"getelementptr double, ptr %{NODES}, i64 {lane * width}")
            for lane in range(self.of.nodes)
        ]
        store_lines(into, columns, pointers)
        return into

    def take_node(self) -> Function:
        """``take_node(node, x, motor, table)``: copies what follows the slope in such a line."""
        into = Function("take_node", [NODES, "x", "motor", "table"], Shape(1))
        first = 2 * self.of.emission.states
        for name in ("x", "motor", "table"):
            count = self.columns[name]
            for k in range(0, count, 8):
                width = min(8, count - k)
                value = into.load(MemorySlot(NODES, first + k), 0, width)
                into.store(value, MemorySlot(name, k), 0, width)
            first += count
        return into

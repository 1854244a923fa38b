"""States in a collocation step, and what is made of them, in LLVM's language: N at once."""

import math
from collections.abc import Sequence

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
from ab_sim.tracing import Expression, Level
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, literal
from ab_sim.tracing.transposed import lines_of, store_line

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
        places |= {**of.state_places(), **dict(of.row_places(FORCES, "f"))}
        for name, place in of.state_places().items():
            places[f"bound[{name}]"] = place._replace(pointer=BOUNDS)
        pointers = [OWN, TABLES, OPEN, WEIGHTS, BOUNDS, STATE, FORCES, STATES]
        into, body = of.function("sample", pointers, ["begin", "length"], places, [BOUNDS])
        targets = self._lines_of_states()
        roots = of.lowered(of.steps.sample())
        of.compute(body, roots.values(), {})
        for name, x in roots.items():
            body.store(x, targets[name])
        return into

    def _lines_of_states(self) -> MemorySlots:
        """See ``run.Buffers.states``."""
        found = MemorySlots()
        for name, place in self.of.state_places().items():
            found[name] = MemorySlot(STATES, STRIDE * place.at, STRIDE)
        for name, line in (("time", TIME), ("profile_time", PROFILE_TIME), ("inside", INSIDE)):
            found[name] = MemorySlot(STATES, STRIDE * (self.of.states + line))
        return found

    def _of_states(
        self, name: str, pointers: Sequence[str], numbers: Sequence[str], times: Sequence[str]
    ) -> tuple[Function, Body]:
        """A function of states in lanes."""
        places: dict[str, MemorySlot] = self._lines_of_states()
        places |= {each: MemorySlot(TIMES, STRIDE * k) for k, each in enumerate(times)}
        places["whole turns"] = MemorySlot(TURNS, 0)
        if self.model.has_motor:
            places["spindle's whole turns"] = MemorySlot(TURNS, self.model.count)
        return self.of.function(name, [TIMES, STATES, *pointers], numbers, places, [TURNS])

    def rows(self) -> Function:
        """``rows(c, b, times, states, turns, samples, width, count)``.

        Writes the first ``count`` of N samples, a row each, ``width`` numbers apart.
        """
        times = ("time", "profile_time")
        into, body = self._of_states("rows", [TURNS, SAMPLES], ["width", "count"], times)
        lines = lines_of(into, self._row(into, body))
        width, count = (into.put(f"fptosi double %{name} to i64") for name in ("width", "count"))
        for lane, line in enumerate(lines):
            here = into.put(f"icmp sgt i64 {count}, {lane}")
            into.lines += [f"br i1 {here}, label %lane{lane}, label %done", f"lane{lane}:"]
            offset = into.put(f"mul i64 {width}, {lane}")
            pointer = into.put(f"getelementptr double, ptr %{SAMPLES}, i64 {offset}")
            store_line(into, line, pointer)
        into.lines += ["br label %done", "done:"]
        return into

    def _row(self, into: Function, body: Body) -> list[str]:
        """A sample's row, see ``kernels.emission.Emission.store_row``, with whole turns."""
        model, graph = self.model, self.model.graph
        sample = self.of.emission.roots["sample"]
        found = [body.values(x)[0] for x in sample]
        if model.has_motor:
            turns = body.values(graph.input("spindle's whole turns", Level.PARAMETER))
            found[0] = _with_turns(into, found[0], turns[0])
        if model.count:
            turns = body.each(graph.input("whole turns", Level.PARAMETER, each=True))
            angles, rates = (body.each(graph.input(x, each=True)) for x in ("theta", "rate"))
            for angle, turn, rate in zip(angles, turns, rates, strict=True):
                found += [_with_turns(into, angle, turn), rate]
        if model.has_motor:
            found += body.values(self.of.emission.roots["torque"][0])
        return found

    @property
    def columns(self) -> dict[str, int]:
        """What ``evaluate`` says of one node: how many numbers of each, in their order."""
        model, states = self.model, self.of.states
        table = len(self.of.emission.roots.get("table", ())) * model.count
        return {"y": states, "slope": states, "x": model.unknowns, "motor": 3, "table": table}

    def evaluate(self) -> Function:
        """``evaluate(c, b, times, states, nodes)``: of each node a line of ``columns``."""
        into, body = self._of_states("evaluate", [NODES], [], ("time",))
        emission, model = self.of.emission, self.model
        columns: list[str] = []
        for roots in (self._states(), emission.roots["slope"]):
            for k, x in enumerate(roots):
                is_ball = k in (model.states, model.states + 1)
                if model.count or not is_ball:
                    columns += body.each(x) if is_ball else body.values(x)
        for name in ("accelerations", "motor"):
            for x in emission.roots[name]:
                columns += body.values(x)
        for x in emission.roots["table"] if model.count else ():
            columns += body.each(x)
        width = sum(self.columns.values())
        for lane, line in enumerate(lines_of(into, columns)):
            store_line(into, line, f"%{NODES}", lane * width)
        return into

    def _states(self) -> list[Expression]:
        """All states, in their order; of the balls, one for all."""
        model, given = self.model, self.model.graph.input
        names = [f"deck[{j}]" for j in range(model.states)]
        rest = ["psi", "omega", "integral"] if model.has_motor else []
        rest += ["work", "dissipated"] if model.has_energy_balance else []
        balls = [given(name, each=True) for name in ("theta", "rate")]
        return [*map(given, names), *balls, *map(given, rest)]

    def take_node(self) -> Function:
        """``take_node(node, x, motor, table)``: copies what follows the slope in such a line."""
        into = Function("take_node", [NODES, "x", "motor", "table"], Shape(1))
        first = 2 * self.of.states
        for name in ("x", "motor", "table"):
            count = self.columns[name]
            for k in range(0, count, 8):
                width = min(8, count - k)
                value = into.load(MemorySlot(NODES, first + k), 0, width)
                into.store(value, MemorySlot(name, k), 0, width)
            first += count
        return into


def _with_turns(into: Function, angle: str, turns: str) -> str:
    """As control does it in ``fixed_step.record``: not fused."""
    lanes = into.shape.lanes
    of = f"<{lanes} x double>" if lanes > 1 else "double"
    product = into.put(f"fmul {of} {literal(2.0 * math.pi, lanes)}, {turns}")
    return into.put(f"fadd {of} {angle}, {product}")

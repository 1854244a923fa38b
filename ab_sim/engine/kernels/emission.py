"""Emit functions of a model's expressions as LLVM IR, and place their inputs in memory."""

from collections.abc import Mapping, Sequence
from math import pi

from ab_sim.engine.kernels.constants import PLACE_FIELDS, ConstantsLayout
from ab_sim.engine.kernels.model import OF_EACH_BALL, Evaluated, Model
from ab_sim.tracing import Expression, Level, lowered
from ab_sim.tracing.expression import ROWS
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, border

CONSTANTS, BRANCHES, TIMES = "c", "b", "t"
"""Names of pointers: constants, branches of set-valued laws, and in lanes the times."""


class Emission:
    """Emitter of a model's functions.

    Parameters
    ----------
    model
        Equations as expressions.
    layout
        Layout of the constants.
    segment_fields
        Names of a segment's fields.
    """

    def __init__(
        self, model: Model, layout: ConstantsLayout, segment_fields: tuple[str, ...]
    ) -> None:
        self.model, self.layout = model, layout
        n = model.count
        columns = model.balls._fields[1:]
        self.places = {name: MemorySlot(CONSTANTS, k) for k, name in enumerate(layout.scalars)}
        for k, name in enumerate(columns):
            self.places[name] = MemorySlot(CONSTANTS, layout.balls + k * n)
        fields = [*(f"segment.{name}" for name in segment_fields), *PLACE_FIELDS]
        for k, name in enumerate(fields):
            self.places[name] = MemorySlot(CONSTANTS, layout.place + k)
        self.places["sign"] = MemorySlot(BRANCHES, 0)
        self.places["mobility_now"] = self.places[ROWS] = MemorySlot(BRANCHES, n)
        self.places["limit"] = MemorySlot(BRANCHES, n + n * (n if model.has_contact else 1))
        at = model.motion()
        evaluated = model.evaluated(at)
        roots = {
            "slope": model.slope(at, evaluated),
            "sample": model.sample(at, evaluated),
            "accelerations": [model.lifted(x) for x in evaluated.solved.x],
            "motor": self.motor(evaluated),
            "torque": [model.lifted(evaluated.spindle.torque)],
        }
        if model.has_events:
            roots["table"] = model.table(at, evaluated)
            roots["block"] = model.block(evaluated.arrow)
        self.roots = self.lowered(roots)
        self.derived_slots: dict[int, MemorySlot] = {}
        self.size = layout.size
        """Number of constants, including derived ones."""
        self.derived: list[Expression] = []
        """Derived constants, in the order in which they follow the raw ones."""
        # Subexpressions that depend on parameters only are moved out of the functions: ``prepare``
        # computes them once, and the functions load them.
        for x in border([x for group in self.roots.values() for x in group], Level.PARAMETER):
            self.derived_slots[x.number] = MemorySlot(CONSTANTS, self.size)
            self.derived.append(x)
            self.size += n if x.each else 1
        if model.has_events:
            # Built from lowered expressions, not lowered together with them: an additional use of
            # a product would prevent its fusion, and so change the rounding of other formulas.
            accelerations = self.roots["accelerations"]
            self.roots["table"] = model.with_forces(self.roots["table"], accelerations)

    def implicit_slope(self) -> list[Expression]:
        """Return the rates of change with the drag at the speeds reached after ``ahead`` [s].

        The input ``ahead`` makes the drag implicit, see ``Model.mobility``.
        """
        at, ahead = self.model.motion(), self.model.graph.input("ahead", Level.TIME)
        slope = self.model.slope(at, self.model.evaluated(at, ahead))
        return self.lowered({"slope": slope})["slope"]

    @property
    def states(self) -> int:
        """Number of states, those of all balls included."""
        # Two of the names, the balls' angle and rate, stand for all balls.
        return len(self.model.state_names) - 2 + 2 * self.model.count

    @property
    def row_channels(self) -> int:
        """Number of channels in a sample's row."""
        return len(self.roots["sample"]) + 2 * self.model.count + self.model.has_motor

    def motor(self, evaluated: Evaluated) -> list[Expression]:
        """Return the commanded torque and its limit [N m], and the spindle's speed [rad/s]."""
        torques = evaluated.torques
        pair = (torques.commanded, torques.limit) if torques else (0.0, 0.0)
        return [self.model.lifted(x) for x in (*pair, evaluated.spindle.speed)]

    def lowered(self, roots: Mapping[str, Sequence[Expression]]) -> dict[str, list[Expression]]:
        """Return groups of expressions, lowered together so that they share subexpressions."""
        flat = iter(lowered([x for group in roots.values() for x in group]))
        return {name: [next(flat) for _ in group] for name, group in roots.items()}

    def state_places(self, pointer: str) -> dict[str, MemorySlot]:
        """Return the positions of the states relative to a pointer."""
        places, at = {}, 0
        for name in self.model.state_names:
            places[name] = MemorySlot(pointer, at)
            at += self.model.count if name in OF_EACH_BALL else 1
        return places

    def prepare(self, lanes: int = 1) -> Function:
        """Emit ``prepare(c)``, which computes the derived constants."""
        into = Function("prepare", [CONSTANTS], Shape(self.model.count, lanes))
        body = Body(into, self.places)
        for x in self.derived:
            body.store(x, self.derived_slots[x.number])
        return into

    def function(
        self,
        name: str,
        pointers: Sequence[str],
        numbers: Sequence[str],
        *,
        state: str | None = None,
        lanes: int = 1,
        uniform: Sequence[str] = (),
        times: bool = False,
    ) -> tuple[Function, Body]:
        """Return a new function with the arguments c, b, pointers and numbers, and its empty body.

        Parameters
        ----------
        name
            Name of the function.
        pointers
            Names of further pointers.
        numbers
            Inputs that are passed as doubles; in lanes, they are in memory one after the other at
            the pointer ``TIMES``, which comes after b.
        state
            Name of the pointer to the state.
        lanes
            Number of runs or instants computed together.
        uniform
            Pointers to numbers that are the same in all lanes.
        times
            True if numbers are at ``TIMES`` without lanes, too.
        """
        shape, places = Shape(self.model.count, lanes), dict(self.places)
        places |= self.state_places(state) if state else {}
        first, bound = [CONSTANTS, BRANCHES], {}
        if lanes > 1 or times:
            first.append(TIMES)
            places |= {number: MemorySlot(TIMES, k) for k, number in enumerate(numbers)}
            numbers = ()
        else:
            bound = {number: [f"%{number}"] for number in numbers}
        into = Function(name, [*first, *pointers], shape, numbers, uniform)
        return into, Body(into, places, self.derived_slots, bound)

    def store_slope(self, body: Body, roots: Sequence[Expression], pointer: str) -> None:
        """Emit stores of the rates of change of all states."""
        for (name, place), x in zip(self.state_places(pointer).items(), roots, strict=False):
            is_ball = name in OF_EACH_BALL
            if self.model.count or not is_ball:
                body.store(x, place, per_ball=is_ball)

    def row(self, turned: bool) -> tuple[list[Expression], tuple[Expression, Expression]]:
        """Return a sample's row without a motor's torque: spindle and deck, angles and rates.

        With ``turned``, whole turns are added, from the inputs ``turns`` of each ball and ``turn``
        of a motor's spindle.
        """
        graph, roots = self.model.graph, list(self.roots["sample"])
        angles, rates = (graph.input(name, per_ball=True) for name in OF_EACH_BALL)
        if turned:
            angles = angles + graph.input("turns", per_ball=True) * (2.0 * pi)
            if self.model.has_motor:
                roots[0] = roots[0] + graph.input("turn") * (2.0 * pi)
        return roots, (angles, rates)

    def store_columns(
        self,
        body: Body,
        pointer: str,
        first: Sequence[Expression],
        of_balls: Sequence[Expression],
        torque: Expression,
    ) -> None:
        """Emit stores in the layout of a row: spindle and deck, numbers of each ball, motor.

        Parameters
        ----------
        body
            Emitter to use.
        pointer
            Name of the pointer to the row.
        first
            Numbers of spindle and deck.
        of_balls
            Quantities per ball; those of one ball are adjacent in the row.
        torque
            Motor torque, which is left out without a motor.
        """
        for k, x in enumerate(first):
            body.store(x, MemorySlot(pointer, k))
        ball_column, n = len(first), self.model.count
        for k, node in enumerate(of_balls if n else ()):
            body.store(node, MemorySlot(pointer, ball_column + k, stride=len(of_balls)))
        if self.model.has_motor:
            body.store(torque, MemorySlot(pointer, ball_column + len(of_balls) * n))

    def slope(self, lanes: int = 1) -> Function:
        """Emit ``slope(c, b, y, k, time)``, which writes the rates of change of the states to k."""
        into, body = self.function("slope", ["y", "k"], ["time"], state="y", lanes=lanes)
        self.store_slope(body, self.roots["slope"], "k")
        return into

    def finish(self, lanes: int = 1) -> Function:
        """Emit ``finish(c, b, y, k, row, time, profile_time)``: slope and sample at a step's end.

        In lanes, it is ``finish(c, b, t, y, k, turns, row)``, and adds the whole turns of the balls
        and of a motor's spindle.
        """
        names, pointers = ["time", "profile_time"], ["y", "k", *["turns"] * (lanes > 1), "row"]
        into, body = self.function("finish", pointers, names, state="y", lanes=lanes)
        self.store_slope(body, self.roots["slope"], "k")
        body.places |= {
            "turns": MemorySlot("turns", 0),
            "turn": MemorySlot("turns", self.model.count),
        }
        self.store_columns(body, "row", *self.row(lanes > 1), self.roots["torque"][0])
        return into

    def evaluate(self, lanes: int = 1) -> Function:
        """Emit ``evaluate(c, b, y, k, x, motor, table, time)``: slope and table for events."""
        pointers = ["y", "k", "x", "motor", "table"]
        into, body = self.function("evaluate", pointers, ["time"], state="y", lanes=lanes)
        self.store_slope(body, self.roots["slope"], "k")
        for k, x in enumerate(self.roots["accelerations"]):
            body.store(x, MemorySlot("x", k))
        for k, x in enumerate(self.roots["motor"]):
            body.store(x, MemorySlot("motor", k))
        n = self.model.count
        for k, x in enumerate(self.roots["table"] if n else ()):
            body.store(x, MemorySlot("table", k * n), per_ball=True)
        return into

    def arrow(self) -> Function:
        """Emit ``arrow(c, b, y, block, time)``, which writes the equations' block with forces."""
        into, body = self.function("arrow", ["y", "block"], ["time"], state="y")
        for k, x in enumerate(self.roots["block"]):
            body.store(x, MemorySlot("block", k))
        return into

    def restitution(self) -> Function:
        """Emit ``restitution(c, b, out, approach)``: the coefficient for an approach speed."""
        into, body = self.function("restitution", ["out"], ["approach"])
        (root,) = lowered([self.model.restitution()])
        body.store(root, MemorySlot("out", 0))
        return into

    def apply_impulse(self) -> Function:
        """Emit ``apply_impulse(c, b, y, jumps, v)``, which adds jumps of velocity to v.

        v has the layout of the states.
        """
        into, body = self.function("apply_impulse", ["y", "jumps", "v"], [], state="y")
        model = self.model
        places = dict(body.places) | {
            f"jump[{r}]": MemorySlot("jumps", r) for r in range(model.unknowns)
        }
        before = {j: model.graph.input(f"before[{j}]") for j in range(model.states)}
        places |= {f"before[{j}]": MemorySlot("v", j) for j in before}
        emitted = Body(into, places, self.derived_slots)
        added = model.jump(model.motion())
        sums = lowered([before[j] + x for j, x in enumerate(added)])
        # Compute all sums before the first store: v may be the memory of y.
        for x in sums:
            emitted.values(x)
        for j, x in enumerate(sums):
            emitted.store(x, MemorySlot("v", j))
        return into

"""Collocation's formulas in LLVM's language, and where their numbers are in memory.

The arguments of what is emitted are pointers to doubles, then doubles; see ``ab_sim.collocation``.
N is the number of nodes, a line is N doubles, E the number of equations, of which the deck has the
first, then each ball, then a motor's spindle; R is E and the number of integrals behind them.
"""

import re
from collections.abc import Iterable, Mapping, Sequence

from ab_sim.collocation.ball_order import ball_by_ball
from ab_sim.collocation.coordinates import Coordinates
from ab_sim.collocation.formulas import Formulas, Roots
from ab_sim.collocation.responses import (
    BEYOND,
    DAMPING,
    MOST_UNIT,
    STIFFNESS,
    lines_of_table,
)
from ab_sim.collocation.responses import NUMBERS as NUMBERS_EACH
from ab_sim.collocation.run import (
    COEFFICIENTS,
    NODE,
    SHARE,
)
from ab_sim.collocation.step_formulas import StepFormulas
from ab_sim.kernels.emission import BRANCHES, CONSTANTS, Emission
from ab_sim.tracing import Expression, Level, lowered
from ab_sim.tracing.expression import reached, rebuilt
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, border
from ab_sim.tracing.lowering import mapped
from ab_sim.tracing.unrolled import name_of, unrolled

OWN, TABLES, OPEN, NUMBERS, OPEN_NUMBERS = "own", "tables", "spindle", "numbers", "spindle_numbers"
WORK, RESULT, WEIGHTS, CARRY = "work", "result", "weights", "carry"
STATE, STATES, OLD, FORCES, BOUNDS = "y", "states", "old", "f", "bounds"
"""Names of pointers."""


AT_ONCE = 128
"""Nodes times balls up to which all balls' numbers are held at the same time: more do not fit into
registers by far, and to write them elsewhere takes longer than to compute with them."""
MANY_BALLS = 16
"""Balls beyond which there is one kind of iteration only."""
OF_BALL = re.compile(r"(.+)\[(\d+)\]")
"""What an input of one ball is called, see ``unrolled.name_of``."""
MATRICES = ("into_x", "into_v", "into_pull")
AT_INSTANTS = ("response_to_one", "impulse", "impulse_rate")
"""Parts of a table, in the order of ``responses``: N lines each, and one line each."""


def ball_of(name: str) -> int | None:
    """Of which ball an input is."""
    found = OF_BALL.fullmatch(name)
    return int(found[2]) if found else None


def inputs_of(roots: Iterable[Expression]) -> dict[str, Expression]:
    """What some depend on of what is given, by its name."""
    return {x.payload: x for x in reached(roots) if x.op == "input"}


class MemorySlots(dict[str, MemorySlot]):
    """Where inputs are, by their names; those of balls one by one, too."""

    def __missing__(self, name: str) -> MemorySlot:
        found = OF_BALL.fullmatch(name)
        if found is None:
            raise KeyError(name)
        first = self[found[1]]
        return first._replace(at=first.at + int(found[2]) * first.stride)


class CollocationEmission:
    """Functions of a collocation step for one kind of scene.

    Args:
        emission: of the scene's equations.
        coordinates: of its deck.
        nodes: N, a power of two.
        balls_alike: whether drag slows down all balls alike.
    """

    def __init__(
        self, emission: Emission, coordinates: Coordinates, nodes: int, balls_alike: bool
    ) -> None:
        self.emission, self.model, self.nodes = emission, emission.model, nodes
        self.balls_alike = balls_alike
        self.formulas = Formulas(self.model, coordinates, nodes, balls_alike)
        self.steps = StepFormulas(self.formulas)
        equations = coordinates.count + self.model.count + self.model.has_motor
        self.rows = equations + len(self.formulas.integrals)
        self._own = MemorySlots(self.row_places(WORK, "f"))
        self.work = self.rows
        """Lines of the work."""
        # Of a deck in space, cosines and sines are the least; many balls take long to compile.
        once = coordinates.has_modes or self.model.count > MANY_BALLS
        ways = (False,) if once else (False, True)
        self._iterate = {near: self.lowered(self.formulas.iterate(near)) for near in ways}
        self._hoisted = self._known_before()

    # Where things are.

    def row_places(self, pointer: str, what: str) -> Iterable[tuple[str, MemorySlot]]:
        """Lines of f: of the equations, then of what is only integrated."""
        at = 0
        for each in self.formulas.equations[:-1]:
            yield f"{what}[{each}]", MemorySlot(pointer, at)
            at += self.model.count if each.each else 1
        for name in self.formulas.integrals:
            yield f"{what}[{name}]", MemorySlot(pointer, at)
            at += 1

    def _table_of(self) -> dict[str, tuple[str, int, int]]:
        """Of each left-hand side: its table's pointer, the which it is, and steps ball by ball."""
        found, at = {}, 0
        for each in self.formulas.equations:
            if each.side in found:
                continue
            is_open = each is self.formulas.spindle
            found[each.side] = OPEN if is_open else TABLES, 0 if is_open else at, 1
            at += self.model.count if each.side_each else 1
        return found

    @property
    def tables(self) -> int:
        """How many tables there are up to the same instants, but for the last one.

        That is of what is only integrated.
        """
        return self._table_of()[self.formulas.integral.side][1]

    def table_places(self) -> dict[str, MemorySlot]:
        """Where the tables' lines are; that of a motor's spindle behind a pointer of its own."""
        found, size = {}, lines_of_table(self.nodes)
        matrices = [f"{what}.{k}" for what in MATRICES for k in range(self.nodes)]
        for name, (pointer, at, stride) in self._table_of().items():
            for line, one in enumerate([*matrices, *AT_INSTANTS]):
                place = MemorySlot(pointer, at * size + line, stride * size)
                found[f"{one}[{name}]"] = place
        return found

    def _numbers(self) -> dict[str, MemorySlot]:
        """Where the tables' numbers are; those up to the samples behind those up to the nodes."""
        found, samples = {}, (self.tables + 1) * NUMBERS_EACH
        columns = {"damping": DAMPING, "stiffness": STIFFNESS, "unit": MOST_UNIT, "beyond": BEYOND}
        columns["beyond_samples"] = BEYOND + samples
        for name, (pointer, at, stride) in self._table_of().items():
            behind = NUMBERS if pointer == TABLES else OPEN_NUMBERS
            for what, column in columns.items():
                place = MemorySlot(behind, at * NUMBERS_EACH + column, stride * NUMBERS_EACH)
                found[f"{what}[{name}]"] = place
        return found

    def linear_places(self) -> dict[str, MemorySlot]:
        """c and k of each table; then what makes coordinates, see ``coordinates.DeckModes``."""
        found = {}
        for name, (pointer, at, stride) in self._table_of().items():
            at = at if pointer == TABLES else self.tables - 1
            found[f"damping[{name}]"] = MemorySlot(OWN, at, stride)
            found[f"stiffness[{name}]"] = MemorySlot(OWN, self.tables + at, stride)
        return found | self._modes()

    def _modes(self) -> dict[str, MemorySlot]:
        found, first = {}, 2 * self.tables
        for name in ("from_modes", "to_modes"):
            for r in range(7):
                for q in range(7):
                    found[f"{name}[{r},{q}]"] = MemorySlot(OWN, first + 7 * r + q)
            first += 49
        return found

    def weight_places(self) -> dict[str, MemorySlot]:
        """c_j; the weights of the quadrature; matrices to the last coefficients, and onward."""
        nodes = self.nodes
        found = {"node": MemorySlot(WEIGHTS, NODE), "share": MemorySlot(WEIGHTS, SHARE)}
        for k in range(nodes):
            found[f"coefficient.{k}"] = MemorySlot(WEIGHTS, COEFFICIENTS + k)
            found[f"carry.{k}"] = MemorySlot(CARRY, k)
        return found

    def _line(self, name: str, each: bool) -> MemorySlot:
        """Where a quantity is in the work, which grows if it is new."""
        if name not in self._own:
            self._own[name] = MemorySlot(WORK, self.work)
            self.work += self.model.count if each else 1
        return self._own[name]

    # What is computed.

    def ball_by_ball(self, roots: Roots) -> Roots:
        """Roots without the balls' axis: in lanes, what is of one ball is computed in one go."""
        columns = unrolled(roots.values(), self.model.count)
        found = Roots()
        for (name, root), column in zip(roots.items(), columns, strict=True):
            names = [name_of(name, k) for k in range(len(column))] if root.each else [name]
            found |= dict(zip(names, column, strict=True))
        return found

    def lowered(self, roots: Roots) -> Roots:
        """The same as a machine computes them."""
        flat = self.ball_by_ball(roots)
        return dict(zip(flat, lowered(flat.values()), strict=True))

    def _known_before(self) -> dict[int, MemorySlot]:
        """What an iteration needs that no iteration changes: put into the work by ``start``."""
        found: dict[int, MemorySlot] = {}
        elsewhere = {**self.emission.places, **self.table_places()}
        elsewhere |= {**self._modes(), **self._scale()}
        self._before: list[tuple[Expression, MemorySlot]] = []
        for roots in self._iterate.values():
            for name in [*roots, *inputs_of(roots.values())]:
                of_ball = OF_BALL.fullmatch(name)
                base = of_ball[1] if of_ball else name
                # Whatever is nowhere else.
                if base not in elsewhere and not base.startswith("result"):
                    self._line(base, of_ball is not None)
            for x in border([*roots.values()], Level.TIME):
                if x.number not in self.emission.known and x.number not in found:
                    found[x.number] = MemorySlot(WORK, self.work)
                    self.work += 1
                    self._before.append((x, found[x.number]))
        return found

    def _scale(self) -> dict[str, MemorySlot]:
        """1 / R of the first ball."""
        first = self.emission.places["race_curvature"]
        return {"scale": first}

    # What is emitted.

    def function(
        self,
        name: str,
        pointers: Sequence[str],
        numbers: Sequence[str],
        places: Mapping[str, MemorySlot],
        uniform: Iterable[str] = (),
        known: Mapping[int, MemorySlot] | None = None,
    ) -> tuple[Function, Body]:
        """A function in lanes with the arguments c, b, pointers and numbers; its body is empty.

        Args:
            name: of the function.
            pointers: names of further pointers.
            numbers: inputs that are handed over as doubles.
            places: where inputs are.
            uniform: further pointers to what is the same in all lanes.
            known: where other nodes are already.
        """
        shape = Shape(self.model.count, self.nodes)
        always = [CONSTANTS, BRANCHES, OWN, NUMBERS, OPEN_NUMBERS, STATE, RESULT]
        into = Function(name, [CONSTANTS, BRANCHES, *pointers], shape, numbers, [*always, *uniform])
        bound = {each: [into.widened(f"%{each}", self.nodes)] for each in numbers}
        own = MemorySlots({**self.emission.places, **self._scale(), **places})
        return into, Body(into, own, {**self.emission.known, **(known or {})}, bound)

    def iterate(self, near: bool = False) -> Function:
        """``iterate(c, b, own, tables, spindle, work, result)``; ``near``: see ``Formulas``."""
        places = {**self.table_places(), **self._modes(), **self._own}
        name = "iterate_near" if near else "iterate"
        pointers = [OWN, TABLES, OPEN, WORK, RESULT]
        into, body = self.function(name, pointers, [], places, known=self._hoisted)
        self._store(body, self._iterate[near], self._hoisted)
        return into

    def store(
        self,
        body: Body,
        roots: Roots,
        places: Mapping[str, MemorySlot],
        known: Mapping[int, MemorySlot],
    ) -> None:
        """Emit expressions, and write each to its place: of many balls as soon as it is there."""
        order, waiting = self.in_order(roots.values(), known), dict(roots)
        if self.has_many_balls:
            names: dict[int, list[str]] = {}
            for name, x in roots.items():
                names.setdefault(x.number, []).append(name)
            given = inputs_of(roots.values())
            for x in order:
                body.values(x)
                for name in names.get(x.number, ()):
                    if name in given:
                        body.values(given[name])  # before it is something else
                    body.store(waiting.pop(name), places[name])
        for x in (*order, *roots.values()):
            body.values(x)
        for name, x in waiting.items():
            body.store(x, places[name])

    @property
    def has_many_balls(self) -> bool:
        """Whether not all balls' numbers are held at the same time."""
        return self.model.count * self.nodes > AT_ONCE

    def in_order(
        self, roots: Iterable[Expression], known: Mapping[int, MemorySlot]
    ) -> list[Expression]:
        """What has to be computed, without what is at hand.

        In the order in which it is written, matrices column by column, then: what is known of all
        balls is held at the same time. Of many, one ball after the other.
        """
        at_hand = {*known, *self.emission.known}
        order = [
            x
            for x in reached(roots, at_hand)
            if x.number not in at_hand and x.op not in ("input", "const", "lane")
        ]
        return ball_by_ball(order, self.model.count, ball_of) if self.has_many_balls else order

    def _store(
        self, body: Body, roots: Roots, known: Mapping[int, MemorySlot] | None = None
    ) -> None:
        own = {
            name: MemorySlot(RESULT, int(name[7:]))
            if name.startswith("result.")
            else self._own[name]
            for name in roots
        }
        self.store(body, roots, own, known or {})

    def start(self) -> Function:
        """``start(c, b, own, ..., begin, length, moved)``: see ``ab_sim.collocation``."""
        roots = self.ball_by_ball(self.steps.start())
        inputs = inputs_of(x for x, _ in self._before)
        by = {inputs[name]: root for name, root in roots.items() if name in inputs}
        own = lowered([*roots.values(), *mapped([x for x, _ in self._before], rebuilt, by)])
        count = len(roots)
        places = {
            **self.table_places(),
            **self.linear_places(),
            **self._numbers(),
            **self.weight_places(),
        }
        places |= {**self.emission.state_places(STATE), **dict(self.row_places(OLD, "old"))}
        pointers = [OWN, NUMBERS, OPEN_NUMBERS, TABLES, OPEN, WEIGHTS, CARRY, STATE, OLD, WORK]
        into, body = self.function("start", pointers, ["begin", "length", "moved"], places)
        named = dict(zip(roots, own[:count], strict=True))
        self._store(body, {name: x for name, x in named.items() if self._is_used(name)})
        for x, (_, place) in zip(own[count:], self._before, strict=True):
            body.store(x, place)
        return into

    def _is_used(self, name: str) -> bool:
        """Whether the work has a place for a quantity."""
        of_ball = OF_BALL.fullmatch(name)
        return name in self._own or (of_ball is not None and of_ball[1] in self._own)

    def judge(self) -> Function:
        """``judge(c, b, numbers, spindle_numbers, weights, work, result, begin, length)``."""
        places = {**self._numbers(), **self.weight_places(), **self._own}
        places |= {f"result.{k}": MemorySlot(RESULT, k) for k in (2, 3)}
        pointers = [NUMBERS, OPEN_NUMBERS, WEIGHTS, WORK, RESULT]
        into, body = self.function("judge", pointers, ["begin", "length"], places)
        self._store(body, self.lowered(self.steps.judge()))
        return into

    def begin(self) -> Function:
        """``begin(c, b, own, y, f, time)``: f at one instant, and the spindle's speed."""
        model = self.model
        at = model.motion()
        found = model.evaluated(at)
        begun = self.steps.begin(found, model.slope(at, found))
        roots = dict(zip(begun, lowered(begun.values()), strict=True))
        into = Function(
            "begin", [CONSTANTS, BRANCHES, OWN, STATE, FORCES], Shape(model.count), ["time"]
        )
        places = {**self.emission.places, **self.linear_places()}
        places |= self.emission.state_places(STATE)
        body = Body(into, places, self.emission.known, {"time": ["%time"]})
        targets = dict(self.row_places(FORCES, "f")) | {"speed": MemorySlot(FORCES, self.rows)}
        for name, x in roots.items():
            body.store(x, targets[name], each="balls" in name)
        return into

    def keep(self) -> Function:
        """``keep(c, b, work, f)``: copies f from the work."""
        into, body = self.function("keep", [WORK, FORCES], [], self._own)
        for name, place in self.row_places(FORCES, "f"):
            body.store(self.model.graph.input(name, each="balls" in name), place)
        return into

    def functions(self) -> list[Function]:
        """All of them."""
        iterations = [self.iterate(near) for near in self._iterate]
        return [*iterations, self.start(), self.judge(), self.keep(), self.begin()]

"""The exact derivative of the equations along states, time and constants at once, emitted.

A *direction* changes the state, the time, the time on the profile, raw constants (those in memory
before what follows from them, see ``constants``) and how the balls yield. As many directions
lie side by side as ``lanes_for`` says. Only constants that are named are looked at: code for three
parameters is not that for a hundred.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.equations.arrowhead import solve
from ab_sim.kernels.code import Code
from ab_sim.kernels.emission import BRANCHES, CONSTANTS, TIMES
from ab_sim.kernels.model import OF_EACH_BALL
from ab_sim.kernels.tangent_step import carry_text
from ab_sim.tracing import Expression, Level, derivatives, total
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, module_text

FEW = 8
"""Balls up to which directions go in lanes; of more, vectors are made of the balls."""
LANES = 8
DIRECTION, OF_CONSTANTS, OF_YIELDING = "d", "dc", "db"
"""Pointers: changes of state, time and time on the profile, one behind the other; of constants, as
they lie in ``c``; of how each ball, or its row, yields to forces, as a share of itself."""
SHIFT, OF_SHIFT = "shift", "dshift"
"""At impacts: how much faster each ball parts than those it would move with, and its change."""


def lanes_for(balls: int) -> int:
    """How many directions go side by side."""
    return LANES if balls <= FEW else 1


def tangent_address(code: Code) -> int:
    """Address of ``tangent(c, b, t, y, d, out)``: the slope's change along d, in ``out``.

    d has a direction in the states, and behind it the change of time; constants and how the balls
    yield stay. y and the time behind t are one number for all directions.
    """
    return _made(code, "tangent")


class TangentAddresses(NamedTuple):
    """Functions ``(c, b, t, y, d, dc, db, out)``; t holds time and time on the profile."""

    step: int
    """A step's: see ``tangent_step``."""
    row: int
    """Of a sample's row, shape (channels from the spindle's angle on, lanes)."""
    table: int
    """Of the accelerations (K), what is asked of the motor (3), and the table for events, line by
    line, shape (K + 3 + lines * n, lanes); 0 without events."""
    impact: int
    """``(.., db, shift, dshift, out)``: of the state just after an impact, shape (states, lanes);
    0 without contact."""
    restitution: int
    """``(c, b, t, dc, approach, dapproach, out)``: shape (1, lanes); 0 without contact."""


def raw_constants(code: Code) -> dict[str, int]:
    """Where raw constants lie, by their names; of the balls' columns the first ball's."""
    none = () if code.model.count else code.model.balls._fields
    places = code.emission.places.items()
    return {n: slot.at for n, slot in places if slot.pointer == CONSTANTS and n not in none}


def parameter_tangents(
    code: Code, names: frozenset[str], tableau: Sequence[np.ndarray]
) -> TangentAddresses:
    """The functions for directions that change these raw constants, made if need be.

    Args:
        code: of the kind of scene.
        names: of ``raw_constants``; others are taken not to change.
        tableau: a, b, c of the explicit Runge-Kutta method.
    """

    def step() -> str:
        return carry_text(_function(code, "slope", names), code.emission.states, tableau)

    model, method = code.model, tuple(part.tobytes() for part in tableau)
    return TangentAddresses(
        code.made(("tangent", method, names), "carry", step),
        _made(code, "row", names),
        _made(code, "table", names) if model.has_events else 0,
        _made(code, "impact", names) if model.has_contact else 0,
        _made(code, "restitution", names) if model.has_contact else 0,
    )


def _made(code: Code, name: str, names: frozenset[str] = frozenset()) -> int:
    """Address of a function, whose directions change the raw constants that are named."""

    def text() -> str:
        return module_text([_function(code, name, names)])

    return code.made(("tangent", name, names), name, text)


def _function(code: Code, name: str, names: frozenset[str]) -> Function:
    emission, model = code.emission, code.model
    directions, places = _directions(code, names, yields=name != "tangent")
    changes = emission.lowered({name: derivatives(_ROOTS[name](code), *directions)})[name]
    pointers, fixed = ["y", DIRECTION, OF_CONSTANTS, OF_YIELDING], ["y"]
    if name == "tangent":
        pointers = ["y", DIRECTION]
    if name == "impact":
        pointers, fixed = [*pointers, SHIFT, OF_SHIFT], ["y", SHIFT]
    if name == "restitution":
        pointers, fixed = [OF_CONSTANTS, "approach", "dapproach"], ["approach"]
    into, body = emission.function(
        name,
        [*pointers, "out"],
        ["time", "profile_time"],
        state="y",
        lanes=lanes_for(model.count),
        uniform=[CONSTANTS, BRANCHES, TIMES, *fixed],
        times=True,
    )
    body.places.update(places)
    if name in ("tangent", "slope", "impact"):
        emission.store_slope(body, changes, "out")
    elif name == "row":
        of_balls = [model.graph.input(f"d {each}", each=True) for each in OF_EACH_BALL]
        emission.store_columns(body, "out", changes[:-1], of_balls, changes[-1])
    elif name == "table":
        _store_table(code, body, changes)
    else:
        body.store(changes[0], MemorySlot("out", 0))
    return into


def _slope(code: Code) -> list[Expression]:
    model, at = code.model, code.model.motion()
    return model.slope(at, model.evaluated(at))


def _row(code: Code) -> list[Expression]:
    model, at = code.model, code.model.motion()
    found = model.evaluated(at)
    return [*model.sample(at, found), model.lifted(found.spindle.torque)]


def _table(code: Code) -> list[Expression]:
    model, at = code.model, code.model.motion()
    found = model.evaluated(at)
    accelerations = [model.lifted(x) for x in found.solved.x]
    table = model.with_forces(model.table(at, found), accelerations)
    return [*accelerations, *code.emission.motor(found), *table]


def _impact(code: Code) -> list[Expression]:
    """The state after an impact whose rows are known: see ``events.impact``."""
    model, at = code.model, code.model.motion()
    shift = model.graph.input(SHIFT, Level.TIME, each=True)
    _, _, on, arrow = model.arrow(at)
    before = on.path - shift
    held = arrow._replace(
        force=[-total(coupling * before) for coupling in arrow.coupling],
        path_force=model.balls.rolling_mass * before,
    )
    prescribed = None if model.has_motor else 0.0
    found = solve(held, model.count, model.mobility, None, prescribed)
    gain = found.path + shift - on.path
    added = model.deck.jump(at.deck, found.x)
    after = [x + more for x, more in zip(at.deck, added, strict=True)]
    after += [at.theta, at.rate + gain * on.curvature]
    if at.spindle is not None:
        after += [at.spindle.psi, at.spindle.speed + found.x[-1], at.spindle.integral]
    return [model.lifted(x) for x in after]


def _restitution(code: Code) -> list[Expression]:
    return [code.model.restitution()]


_ROOTS: dict[str, Callable[[Code], list[Expression]]] = {
    "tangent": _slope,
    "slope": _slope,
    "row": _row,
    "table": _table,
    "impact": _impact,
    "restitution": _restitution,
}


def _directions(
    code: Code, names: frozenset[str], yields: bool
) -> tuple[tuple[dict[Expression, Expression], Expression | None], dict[str, MemorySlot]]:
    """What changes, as ``derivatives`` takes it; and where that is.

    Args:
        code: of the kind of scene.
        names: of raw constants that change.
        yields: whether it changes how the balls yield.
    """
    model, emission = code.model, code.emission
    graph, given = model.graph, emission.state_places(DIRECTION)
    states = emission.states
    kinds = {name: Level.STATE for name in given}
    given |= {
        "time": MemorySlot(DIRECTION, states),
        "profile_time": MemorySlot(DIRECTION, states + 1),
    }
    kinds |= {"time": Level.TIME, "profile_time": Level.TIME}
    for name, where in raw_constants(code).items():
        if name in names:
            given[name], kinds[name] = MemorySlot(OF_CONSTANTS, where), Level.PARAMETER
    given |= {SHIFT: MemorySlot(OF_SHIFT, 0), "approach": MemorySlot("dapproach", 0)}
    kinds |= {SHIFT: Level.TIME, "approach": Level.STATE}
    each = {*OF_EACH_BALL, SHIFT, *model.balls._fields[1:]}
    along: dict[Expression, Expression] = {}
    places = {"d yields": MemorySlot(OF_YIELDING, 0), SHIFT: MemorySlot(SHIFT, 0)}
    places["approach"] = MemorySlot("approach", 0)
    for name, place in given.items():
        source = graph.input(name, kinds[name], each=name in each)
        along[source] = graph.input(f"d {name}", each=name in each)
        places[f"d {name}"] = place
    of_rows = graph.input("d yields", Level.TIME, each=True) if yields else None
    if of_rows is not None and model.has_friction and not model.has_contact:
        now = graph.input("mobility_now", Level.TIME, each=True)
        along[now] = of_rows * now
    return (along, of_rows), places


def _store_table(code: Code, body: Body, changes: Sequence[Expression]) -> None:
    model, n = code.model, code.model.count
    single = model.unknowns + 3
    for k, x in enumerate(changes[:single]):
        body.store(x, MemorySlot("out", k))
    for k, x in enumerate(changes[single:] if n else ()):
        body.store(x, MemorySlot("out", single + k * n), each=True)

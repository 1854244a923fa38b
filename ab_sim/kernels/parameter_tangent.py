"""The exact derivative of the equations along states, time and constants at once, emitted.

A *direction* changes the state, the time, the time on the profile, raw constants (those in memory
before what follows from them, see ``constants``) and how the balls yield. As many directions
lie side by side as ``tangent.lanes_for`` says. Only constants that are named are looked at: code
for three parameters is not that for a hundred.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.equations.arrowhead import solve
from ab_sim.kernels.code import Code
from ab_sim.kernels.constants import PLACE_FIELDS
from ab_sim.kernels.emission import BRANCHES, CONSTANTS, TIMES
from ab_sim.kernels.model import OF_EACH_BALL
from ab_sim.kernels.tangent import lanes_for
from ab_sim.kernels.tangent_step import carry_text
from ab_sim.tracing import Expression, Level, derivatives, total
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, module_text

DIRECTION, OF_CONSTANTS, OF_YIELDING = "d", "dc", "db"
"""Pointers: changes of state, time and time on the profile, one behind the other; of constants, as
they lie in ``c``; of how each ball, or its row, yields to forces, as a share of itself."""
SHIFT, OF_SHIFT = "shift", "dshift"
"""At impacts: how much faster each ball parts than those it would move with, and its change."""


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


def raw_constants(code: Code, segment_fields: Sequence[str]) -> list[tuple[str, int]]:
    """Names of raw constants and where they lie; of the balls' columns the first ball's."""
    layout, n = code.layout, code.model.count
    found = [(name, k) for k, name in enumerate(layout.scalars)]
    columns = code.model.balls._fields[1:]
    found += [(name, layout.balls + k * n) for k, name in enumerate(columns)] if n else []
    fields = [*(f"segment.{name}" for name in segment_fields), *PLACE_FIELDS]
    return found + [(name, layout.place + k) for k, name in enumerate(fields)]


def parameter_tangents(
    code: Code, segment: type[Any], names: frozenset[str], tableau: Sequence[np.ndarray]
) -> TangentAddresses:
    """The functions for directions that change these raw constants, made if need be.

    Args:
        code: of the kind of scene.
        segment: class of its profile's segments.
        names: of ``raw_constants``; others are taken not to change.
        tableau: a, b, c of the explicit Runge-Kutta method.
    """
    key = tuple(sorted(names))

    def address(name: str) -> int:
        def text() -> str:
            return module_text([_function(code, segment, names, name)])

        return code.made(("parameter tangent", name, key), name, text)

    def step() -> str:
        return carry_text(_function(code, segment, names, "slope"), code.emission.states, tableau)

    model, method = code.model, tuple(part.tobytes() for part in tableau)
    return TangentAddresses(
        code.made(("parameter tangent", method, key), "carry", step),
        address("row"),
        address("table") if model.has_events else 0,
        address("impact") if model.has_contact else 0,
        address("restitution") if model.has_contact else 0,
    )


def _function(code: Code, segment: type[Any], names: frozenset[str], name: str) -> Function:
    emission, model = code.emission, code.model
    roots = {
        "slope": _slope,
        "row": _row,
        "table": _table,
        "impact": _impact,
        "restitution": _restitution,
    }[name](code)
    directions, places = _directions(code, segment._fields, names)
    yields = model.graph.input("d yields", Level.TIME, each=True) if model.has_contact else None
    changes = emission.lowered({name: derivatives(roots, directions, yields)})[name]
    pointers, fixed = ["y", DIRECTION, OF_CONSTANTS, OF_YIELDING], ["y"]
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
    if name in ("slope", "impact"):
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


def _directions(
    code: Code, fields: Sequence[str], names: frozenset[str]
) -> tuple[dict[Expression, Expression], dict[str, MemorySlot]]:
    """By input its change, an input too; and where these are."""
    model, emission = code.model, code.emission
    graph, given = model.graph, emission.state_places(DIRECTION)
    states = emission.states
    kinds = {name: Level.STATE for name in given}
    given |= {
        "time": MemorySlot(DIRECTION, states),
        "profile_time": MemorySlot(DIRECTION, states + 1),
    }
    kinds |= {"time": Level.TIME, "profile_time": Level.TIME}
    for name, where in raw_constants(code, fields):
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
    if model.has_friction and not model.has_contact:
        now = graph.input("mobility_now", Level.TIME, each=True)
        along[now] = graph.input("d yields", Level.TIME, each=True) * now
    return along, places


def _store_table(code: Code, body: Body, changes: Sequence[Expression]) -> None:
    model, n = code.model, code.model.count
    single = model.unknowns + 3
    for k, x in enumerate(changes[:single]):
        body.store(x, MemorySlot("out", k))
    for k, x in enumerate(changes[single:] if n else ()):
        body.store(x, MemorySlot("out", single + k * n), each=True)

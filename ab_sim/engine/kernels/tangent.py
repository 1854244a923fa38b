"""Emit the exact directional derivative of the equations, with respect to states and time.

``lanes_for`` returns the number of directions that are computed together.
"""

from ab_sim.engine.kernels.code import Code
from ab_sim.engine.kernels.emission import BRANCHES, CONSTANTS, TIMES
from ab_sim.engine.kernels.model import OF_EACH_BALL
from ab_sim.tracing import Expression, Level, derivatives
from ab_sim.tracing.llvm_text import Function, MemorySlot, module_text

FEW = 8
"""Maximum number of balls for directions in lanes; with more, vectors are formed of the balls."""
LANES = 8
"""Number of directions in lanes."""
DIRECTION = "d"
"""Name of the pointer to the changes of state, time and time on the profile, in this order."""


def lanes_for(balls: int) -> int:
    """Return the number of directions that are computed together."""
    return LANES if balls <= FEW else 1


def tangent_address(code: Code) -> int:
    """Return the address of ``tangent(c, b, t, y, d, out)``, the slope's derivative along d.

    d holds a direction in the states, followed by the changes of the times; the constants and the
    branches of set-valued laws do not change. The derivative is written to out. y and the times at
    t are the same for all directions.
    """

    def text() -> str:
        return module_text([_function(code)])

    return code.made("tangent", "tangent", text)


def _function(code: Code) -> Function:
    emission, model = code.emission, code.model
    along, places = _directions(code)
    at = model.motion()
    slope = model.slope(at, model.evaluated(at))
    changes = emission.lowered({"tangent": derivatives(slope, along)})["tangent"]
    into, body = emission.function(
        "tangent",
        ["y", DIRECTION, "out"],
        ["time", "profile_time"],
        state="y",
        lanes=lanes_for(model.count),
        uniform=[CONSTANTS, BRANCHES, TIMES, "y"],
        times=True,
    )
    body.places.update(places)
    emission.store_slope(body, changes, "out")
    return into


def _directions(code: Code) -> tuple[dict[Expression, Expression], dict[str, MemorySlot]]:
    """Return the change of each input, for ``derivatives``, and the positions of the changes."""
    emission = code.emission
    graph, states = code.model.graph, emission.states
    of_states = emission.state_places(DIRECTION)
    of_times = {
        "time": MemorySlot(DIRECTION, states),
        "profile_time": MemorySlot(DIRECTION, states + 1),
    }
    along: dict[Expression, Expression] = {}
    for names, level in ((of_states, Level.STATE), (of_times, Level.TIME)):
        for name in names:
            many = name in OF_EACH_BALL
            along[graph.input(name, level, per_ball=many)] = graph.input(f"d {name}", per_ball=many)
    return along, {f"d {name}": place for name, place in (of_states | of_times).items()}

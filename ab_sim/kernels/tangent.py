"""The exact derivative of the equations along states and time, emitted.

As many directions lie side by side as ``lanes_for`` says.
"""

from ab_sim.kernels.code import Code
from ab_sim.kernels.emission import BRANCHES, CONSTANTS, TIMES
from ab_sim.kernels.model import OF_EACH_BALL
from ab_sim.tracing import Expression, Level, derivatives
from ab_sim.tracing.llvm_text import Function, MemorySlot, module_text

FEW = 8
"""Balls up to which directions go in lanes; of more, vectors are made of the balls."""
LANES = 8
DIRECTION = "d"
"""Pointer to changes of state, time and time on the profile, one behind the other."""


def lanes_for(balls: int) -> int:
    """How many directions go side by side."""
    return LANES if balls <= FEW else 1


def tangent_address(code: Code) -> int:
    """Address of ``tangent(c, b, t, y, d, out)``: the slope's change along d, in ``out``.

    d has a direction in the states, and behind it the change of time; constants and how the balls
    yield stay. y and the time behind t are one number for all directions.
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
    """By input its change, as ``derivatives`` takes it; and where these changes are."""
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
            each = name in OF_EACH_BALL
            along[graph.input(name, level, each=each)] = graph.input(f"d {name}", each=each)
    return along, {f"d {name}": place for name, place in (of_states | of_times).items()}

"""The exact derivative of the equations of motion along a direction, emitted."""

from functools import partial

from ab_sim.kernels.code import Code
from ab_sim.kernels.emission import BRANCHES, CONSTANTS, TIMES
from ab_sim.tracing import Level, derivatives
from ab_sim.tracing.llvm_text import module_text

FEW = 8
"""Balls up to which directions go in lanes; of more, vectors are made of the balls."""
LANES = 8


def lanes_for(balls: int) -> int:
    """How many directions go side by side."""
    return LANES if balls <= FEW else 1


def tangent_address(code: Code) -> int:
    """Address of ``tangent(c, b, t, y, d, out)``: the slope's change along d, in ``out``.

    d has a direction in the states, and behind it the change of time; as many side by side as
    ``lanes_for`` says. All else, the time behind t, is one number for all of them.
    """
    return code.made("tangent", "tangent", partial(_text, code))


def _text(code: Code) -> str:
    emission, model = code.emission, code.model
    at = model.motion()
    slope = model.slope(at, model.evaluated(at))
    places = emission.state_places("d")
    directions = {
        source: model.graph.input(f"d {source.payload}", each=source.each)
        for source in model.state_inputs()
    }
    directions[at.time] = model.graph.input("d time", Level.STATE)
    roots = emission.lowered({"rates": derivatives(slope, directions)})["rates"]
    lanes = lanes_for(model.count)
    into, body = emission.function(
        "tangent",
        ["y", "d", "out"],
        ["time"],
        state="y",
        lanes=lanes,
        uniform=[CONSTANTS, BRANCHES, TIMES, "y"],
        times=True,
    )
    for name, place in places.items():
        body.places[f"d {name}"] = place
    body.places["d time"] = places["theta"]._replace(at=emission.states)
    emission.store_slope(body, roots, "out")
    return module_text([into])

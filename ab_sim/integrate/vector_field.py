"""The equations of motion for callers outside a kernel: f, and its exact Jacobian."""

from typing import NamedTuple

from ab_sim.dynamics.slope import evaluate
from ab_sim.dynamics.system import Plant, Room
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.on_stack import room_of
from ab_sim.integrate.workspace import room


class OfOneEvaluation(NamedTuple):
    """What of a Workspace an evaluation needs."""

    room: Room


NO_ROOM = OfOneEvaluation(room(0, 0, 0))
"""For systems without events."""


@compiled
def slope_at(system, place, time, state, modes, out, work):  # type: ignore[no-untyped-def]
    """``dynamics.slope.evaluate``: the state's time derivative at local ``time`` [s] into ``out``.

    Args:
        system, place, modes: of a Plant.
        time: s.
        state: the state.
        out: same shape.
        work: a Workspace, or NO_ROOM for a system without events.
    """
    evaluate(Plant(system, place, modes, room_of(system, work)), time, state, out)

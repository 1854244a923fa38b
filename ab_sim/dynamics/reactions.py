"""Forces that the equations of motion leave out: race on ball, ball on ball."""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED, only_if
from ab_sim.dynamics.rows import moves_along, row_start
from ab_sim.dynamics.scratch import (
    ACROSS,
    COS,
    FORCE,
    INERTIA,
    LOAD,
    PATH_ACCELERATION,
    PULL,
    PUSH,
    ROW1,
    ROW2,
    ROW3,
    SIN,
)
from ab_sim.dynamics.system import (
    MASS,
    ball_at,
    ball_count,
    has_contact,
    has_friction,
    has_motor,
    has_runout,
)


def _normal_forces(system: Any, A1: float, A2: float, al: float, scratch: Any) -> None:
    for i in range(ball_count(system)):
        m = system.balls[i, MASS]
        outwards = A1 * scratch[i, COS] + A2 * scratch[i, SIN]
        force = scratch[i, LOAD] - m * outwards
        if has_runout(system.effects):
            force += m * al * scratch[i, ACROSS]
        scratch[i, FORCE] = force


def _pushes(system: Any, A1: float, A2: float, al: float, modes: Any, scratch: Any) -> None:
    n = system.contacts.shape[0]
    begin = row_start(system, modes)
    push = 0.0
    for place in range(n):
        k = (begin + place) % n
        if moves_along(system, modes, k):
            i = ball_at(system, k)
            # What arrives from behind, and what the ball itself does not need.
            push += pull_at(system, i, A1, A2, al, scratch)
            push -= scratch[i, INERTIA] * scratch[i, PATH_ACCELERATION]
        else:
            push = 0.0
        scratch[k, PUSH] = push


normal_forces = only_if(has_friction, _normal_forces)
"""Fill in FORCE, given accelerations; ``(system, A1, A2, al, scratch)``."""
_add_pushes = only_if(has_contact, _pushes)


@register_jitable(**INLINED)
def reactions(system: Any, A1: float, A2: float, al: float, modes: Any, scratch: Any) -> None:
    """Fill in FORCE, the race's normal forces, and PUSH, as far as the effects need them.

    Right after ``derivatives``, with what it returned.
    """
    normal_forces(system, A1, A2, al, scratch)
    _add_pushes(system, A1, A2, al, modes, scratch)


@register_jitable(**INLINED)
def pull_at(system: Any, i: int, A1: float, A2: float, al: float, scratch: Any) -> float:
    """Force along the race on ball i but for its neighbours' pushes and a holding friction [N]."""
    pull = scratch[i, PULL] + scratch[i, ROW1] * A1 + scratch[i, ROW2] * A2
    if has_motor(system.effects):
        pull += scratch[i, ROW3] * al
    return float(pull)

"""Forces that the equations of motion leave out: race on ball, ball on ball."""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED, holds, number_of
from ab_sim.dynamics.race.elimination import moves_along, row_start
from ab_sim.dynamics.race.race import Race, around, ball_at
from ab_sim.dynamics.race.table import (
    FORCE,
    FRICTION,
    INERTIA,
    LOAD,
    PATH_ACCELERATION,
    PULL,
    PUSH,
    REACH,
)


@register_jitable(**INLINED)
def normal_forces(race: Race, x: Any) -> None:
    """Fill in FORCE, given accelerations."""
    table = race.room.table
    for i in range(number_of(race.number)):
        force = table[i, LOAD]
        for r in range(number_of(race.all)):
            force += table[i, REACH + number_of(race.all) + r] * x[r]
        table[i, FORCE] = force


@register_jitable(**INLINED)
def pull_at(race: Race, i: int, x: Any) -> Any:
    """Force along the race on ball i but for its neighbours' pushes and friction [N]."""
    table = race.room.table
    pull = table[i, PULL]
    for r in range(number_of(race.all)):
        pull += table[i, REACH + r] * x[r]
    return pull


@register_jitable(**INLINED)
def rubbed_pull_at(race: Race, i: int, x: Any) -> Any:
    """The same, with what sliding friction takes; after ``normal_forces``."""
    table = race.room.table
    pull = pull_at(race, i, x)
    if holds(race.rubs):
        pull -= table[i, FRICTION] * table[i, FORCE]
    return pull


@register_jitable(**INLINED)
def reactions(race: Race) -> None:
    """Fill in FORCE, the race's normal forces, and PUSH, as far as the balls have such.

    Right after an evaluation of the equations.
    """
    x, table = race.room.acceleration, race.room.table
    if holds(race.rubs):
        normal_forces(race, x)
    if holds(race.meets):
        n = number_of(race.number)
        begin = row_start(race)
        push = 0.0
        for place in range(n):
            k = around(race, begin + place)
            if moves_along(race, k):
                i = ball_at(race, k)
                # What arrives from behind, and what the ball itself does not need.
                push += rubbed_pull_at(race, i, x)
                push -= table[i, INERTIA] * table[i, PATH_ACCELERATION]
            else:
                push = 0.0
            table[k, PUSH] = push

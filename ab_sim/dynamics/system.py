"""What a kernel is compiled for (types) and runs with (values)."""

from math import inf
from typing import Any, NamedTuple

import numpy as np
from numba.core.types.containers import BaseTuple
from numba.extending import overload, register_jitable

from ab_sim.dynamics.dispatch import (
    INLINED,
    any_effect_has,
    attribute,
    forward,
    part_of,
    sum_over_effects,
)

# Few arrays with columns, not many arrays: compiled code passes seven words for each.
MASS, RADIUS, ROLLING_MASS, MOBILITY, MOMENT, ROUND_LEVER, FIRST_TURNS = range(7)
RACE_RADIUS, RACE_CURVATURE, RACE_HEIGHT = 7, 8, 9
"""Columns of System.balls: m_i [kg]; a_i [m]; mu_i = m_i + I_i/a_i^2 [kg], I_i = 0 where balls do
not roll; 1/mu_i; m_i R [kg m]; m_i R - (I_i/a_i^2) a_i [kg m], what the spindle's acceleration asks
of the ball along a round race; whole turns in the ball's angle at the start; of its race R [m], 1/R
(kernels multiply, as a division takes ten times as long), and the height along the shaft [m]."""
BALL_CONSTANTS = 10
ORDER, SPACING = 0, 1
"""Columns of System.contacts: the ball at this place of the row; the distance along the race from
it to the next one in contact [m]."""
DIRECTION, LOADED, JOINED, TURNS = 0, 1, 2, 3
"""Columns of modes, the branches of set-valued laws that hold between two events.

DIRECTION: +1 or -1, in which a ball slides along the race; 0, it sticks, or it is held between
others. Of the last row: +1 or -1 while the motor gives all it can in that direction, else 0.
LOADED: 1 where the race carries the ball. JOINED: 1 where the two balls at a contact touch and
stay so: both slide, or both stick. TURNS: whole turns taken out of a ball's angle; of the last
row, out of the spindle's."""
MODES = 4


class System(NamedTuple):
    """Constants of a scene. An effect that is not in ``effects`` is not in the kernel."""

    carrier: Any
    """What carries the balls: constants of deck and rotor; see ``carriers``."""
    balls: np.ndarray
    """Shape (n, BALL_CONSTANTS), columns as above."""
    contacts: np.ndarray
    """Neighbours along the race, shape (n, 2), columns as above; contact k lies between the balls
    at places k and k + 1 of the row, cyclic. Shape (0, 2) if balls may pass each other."""
    effects: tuple[Any, ...]
    ledger: tuple[Any, ...]
    """(Ledger(),) to keep one, else empty."""
    each: int | tuple[None, ...]
    """How many balls; as a tuple of as many None, the kernel is compiled for exactly this number
    and keeps in registers what it knows of them."""


class Place(NamedTuple):
    """Where a run is along the speed profile."""

    segment: Any
    """Speed segment in force."""
    phase: float
    """Spindle angle at the segment's beginning [rad], whole turns left out."""
    until: float = inf
    """Local time at which the segment ends [s]."""
    angle: float = 0.0
    """Spindle angle at the segment's beginning [rad], with all its turns: for samples."""


class Room(NamedTuple):
    """What one evaluation of the equations writes, besides the slope; K accelerations."""

    table: Any
    """What is known of each ball, shape (n, table_width(K)): see ``race.table``."""
    block: Any
    """The equations of what carries the balls, the balls not yet eliminated: the symmetric matrix'
    upper triangle, and forces in the last column; shape (K, K + 1)."""
    reduced: Any
    """The same with balls eliminated, and overwritten while it is solved; shape (K, K + 1)."""
    acceleration: Any
    """Solution x, the spindle's acceleration [rad/s^2] last; shape (K,)."""
    motor: Any
    """Torque that the motor's speed loop asks for, the most that it gives [N m], and the spindle's
    speed [rad/s]; shape (3,): events only."""


class Plant(NamedTuple):
    """What an evaluation of the equations of motion works with, but for time and state."""

    system: System
    place: Place
    modes: Any
    """Branches of set-valued laws in force, shape (n + 1, MODES), columns as above."""
    room: Room


def ball_count(system: System) -> int:
    """n, a constant of the kernel where the system says so."""
    return len(system.each) if isinstance(system.each, tuple) else system.each


def ball_number(kind: Any) -> int | None:
    """n, where numba's type of a System tells it."""
    each = part_of(kind, "each")
    return len(each) if isinstance(each, BaseTuple) else None


@overload(ball_count, jit_options=INLINED, strict=False)
def _ball_count(system):  # type: ignore[no-untyped-def]
    n = ball_number(system)
    if n is not None:
        return lambda system: n
    return lambda system: system.each


carrier_states = attribute("STATES")
"""How many states a carrier has."""
carrier_unknowns = attribute("UNKNOWNS")
"""How many accelerations of a carrier are solved for."""
channel_count = attribute("SHOWN")
"""How many channels of a sample are a carrier's."""
begin = forward("begin")
bear = forward("bear")
move = forward("move")
show = forward("show")
dissipate = forward("dissipate")
kick = forward("kick")
straighten = forward("straighten")
carrier_coordinates = attribute("COORDINATES")
"""In how many coordinates a carrier's own motion is solved exactly."""
to_coordinates = forward("to_coordinates")
from_coordinates = forward("from_coordinates")
give_way = forward("give_way")
coordinate_accelerations = forward("coordinate_accelerations")
accelerate = forward("accelerate")
on_next_axes = forward("on_next_axes")

deck_force = sum_over_effects("deck_force", (0.0, 0.0))
space_force = sum_over_effects("space_force", (0.0, 0.0))
deck_loss = sum_over_effects("deck_loss", 0.0)
deck_energy = sum_over_effects("deck_energy", 0.0)
space_loss = sum_over_effects("space_loss", 0.0)
space_energy = sum_over_effects("space_energy", 0.0)
mount_energy = sum_over_effects("mount_energy", 0.0)
mount_stiffening = sum_over_effects("mount_stiffening", 0.0)
gravity = sum_over_effects("gravity", (0.0, 0.0))
weight = sum_over_effects("weight", (0.0, 0.0, 0.0))
ball_inertia = sum_over_effects("ball_inertia", 0.0)
ball_drag = sum_over_effects("ball_drag", 0.0)
friction_coefficient = sum_over_effects("friction_coefficient", 0.0)
race_shape = sum_over_effects("race_shape", (0.0, 0.0, 0.0, 0.0))
race_arc = sum_over_effects("race_arc", 0.0)
restitution = sum_over_effects("restitution", 0.0)
felt_acceleration = sum_over_effects("spindle_acceleration", 0.0)
loop_torque = sum_over_effects("loop_torque", 0.0)
integral_rate = sum_over_effects("integral_rate", 0.0)
torque_limit = sum_over_effects("largest_torque", 0.0)
back_torque = sum_over_effects("back_torque", 0.0)
rotor_moment = sum_over_effects("rotor_moment", 0.0)

has_drag = any_effect_has("ball_drag")
has_spin = any_effect_has("ball_inertia")
has_friction = any_effect_has("friction_coefficient")
has_contact = any_effect_has("restitution")
has_runout = any_effect_has("race_shape")
has_gravity = any_effect_has("gravity")
has_space_force = any_effect_has("space_force")
acts_in_space = any_effect_has("space_force", "gravity")
has_stiffening = any_effect_has("mount_stiffening")
has_motor = any_effect_has("rotor_moment")
may_hold = any_effect_has("friction_coefficient", "restitution")
"""Whether balls may stick, or move in rows."""
has_events = any_effect_has("friction_coefficient", "restitution", "rotor_moment")

segment_speed = forward("speed")
segment_acceleration = forward("acceleration")
segment_angle = forward("angle")

carrier_turns = attribute("NEEDS_ANGLE")


@register_jitable(**INLINED)
def has_spindle_angle(system: System) -> bool:
    """Whether the equations contain the spindle's angle."""
    return bool(carrier_turns(system.carrier) or acts_in_space(system.effects))

"""Interface of deck models: constants of deck and rotor, and their motion on the suspension.

A deck model is one file: a NamedTuple of constants whose methods are formulas. The decorator adds
the attributes that all instances share. Balls, friction, events and steppers do not depend on it.

Formulas take the scene's effects, the balls and their positions on the race, the spindle's motion
and the deck's states:

    arrow(self, effects, balls, on, spindle, state) -> Arrow
        equations of motion with the balls fixed to the race: see ``arrowhead``
    rates(self, effects, spindle, state, x)
        rates of change of the deck's states, from the accelerations x
    channels(self, effects, spindle, state, x)
        values of CHANNELS; ``spindle`` then has the cosine and sine of its angle
    dissipated(self, effects, spindle, state) -> W
        power dissipated by the suspension, for the energy balance
    jump(self, state, jumps)
        changes of the deck's states by jumps of velocity, in the order of x
    specific_force(self, effects, channels, point)
        specific force at a point of the deck, one number per axis of the deck [m/s^2]
    free_force(self, effects, spindle, state) -> [N]
    ball_moment(self, on) -> [kg m]
        optional, both or none, for a deck that moves along the rotor's first two axes only: the
        force on it without the balls' reaction, and each ball's mass times its position from the
        shaft. Taylor's method then needs half as many products of series

Methods for numbers:

    place(self, states, psi)
        position of the deck from its states, shape (samples, AXES)
    at_rest(self, states)
        channels of the deck at rest in the given states, shape (1, channels)
    scale(self, length, speed)
        magnitudes of the states from a length and a spindle speed, to which errors are relative
    tangent(self, states)
        basis of the states' tangent space (of a unit quaternion three directions): orthonormal
        columns, two for each unknown
    energy(self, effects, balls, state, psi, speed) -> J
        kinetic and stored energy
"""

from collections.abc import Callable
from typing import Any, TypeVar

Class = TypeVar("Class", bound=type[Any])


def deck_model(
    *,
    STATE_NAMES: tuple[str, ...],
    UNKNOWNS: int,
    NEEDS_ANGLE: bool,
    AXES: int,
    CHANNELS: tuple[str, ...],
    UNIT_AT: int = -1,
) -> Callable[[Class], Class]:
    """Return a class decorator that sets these attributes on a deck model, a NamedTuple.

    Parameters
    ----------
    STATE_NAMES
        Names of the deck's states, for messages.
    UNKNOWNS
        Number of unknown accelerations of the deck.
    NEEDS_ANGLE
        True if the equations contain the spindle's angle with any effects.
    AXES
        Number of axes along which the deck moves: 2 or 3.
    CHANNELS
        Names of the deck's columns in a trajectory; displacement, velocity and acceleration along
        the axes come first.
    UNIT_AT
        Index of the first state of a unit quaternion; -1 without one.
    """
    facts = {**locals(), "STATES": len(STATE_NAMES)}

    def add(kind: Class) -> Class:
        for name, value in facts.items():
            setattr(kind, name, value)
        return kind

    return add

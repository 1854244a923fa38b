"""Constants of the moving bodies, the columns of their arrays, and the layout of the state."""

import functools
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ab_sim.model.equations.motion import BALL_COLUMNS, BallConstants
from ab_sim.model.equations.sums import any_has, over_effects

(MASS, RADIUS, ROLLING_MASS, MOBILITY, MOMENT, LEVER, RACE_RADIUS, RACE_CURVATURE, HEIGHT,
 FIRST_TURNS) = range(len(BALL_COLUMNS) + 1)  # fmt: skip
"""Columns of System.balls: ``BALL_COLUMNS``, then the whole turns in the ball's start angle."""
ORDER, SPACING = 0, 1
"""Columns of System.contacts: number of the ball at this place of the row; distance along the race
from this ball to the next one when they touch [m]."""
DIRECTION, LOADED, JOINED, TURNS = 0, 1, 2, 3
"""Columns of the discrete state: the branches of set-valued laws that hold between two events.

- DIRECTION: +1 or -1, direction in which a ball slides along the race; 0 if it sticks, or is held
  between others. In the last row: +1 or -1 while the motor is at its torque limit in that
  direction, else 0.
- LOADED: 1 if the race carries the ball.
- JOINED: 1 if the two balls at a contact touch and stay in contact: both slide, or both stick.
- TURNS: whole turns removed from a ball's angle; in the last row, from the spindle's.
"""
DISCRETE_COLUMNS = 4
EVENTFUL = {
    "friction_coefficient": "balls stick and slip",
    "restitution": "balls collide",
    "rotor_moment": "a motor reaches its limit",
}
"""Methods by which an effect has a set-valued law, each with the event that the law causes."""


class System(NamedTuple):
    """Constants of a scene. Effects that are not in ``effects`` are not computed.

    The system of a scene with columns of runs has columns in place of numbers, and ``balls`` has
    the shape (n, FIRST_TURNS + 1, runs).
    """

    deck_model: Any
    """Deck and rotor: an instance of a deck model, see ``ab_sim.model.equations.planar``."""
    balls: np.ndarray
    """Constants of the balls, shape (n, FIRST_TURNS + 1), columns as above."""
    contacts: np.ndarray
    """Neighbours along the race, shape (n, 2), columns as above; contact k lies between the balls
    at places k and k + 1 of the row, cyclic. Shape (0, 2) if balls may pass each other."""
    effects: tuple[Any, ...]
    energy_balance: bool = False
    """True if motor work and losses are integrated along with the motion."""

    def mechanical_energy(self, state: Any, psi: float, speed: float) -> float:
        """Return kinetic and stored energy [J]; the rotor's inertia I_r counts with a motor only.

        Parameters
        ----------
        state
            State of the system.
        psi
            Spindle angle [rad].
        speed
            Spindle speed [rad/s].
        """
        balls = BallConstants(len(self.balls), *constants_of_balls(self))
        at = np.asarray(state, float)
        return float(self.deck_model.energy(self.effects, balls, at, float(psi), float(speed)))


def constants_of_balls(system: System) -> np.ndarray:
    """Return the balls' constants that formulas use, shape (``BALL_COLUMNS``, n)."""
    return system.balls[:, :FIRST_TURNS].swapaxes(0, 1).copy()


def stacked(numbers: Iterable[Any]) -> np.ndarray:
    """Return numbers as one float array; if some are columns of runs, the last axis is the run."""
    return np.array(np.broadcast_arrays(*numbers), float)


def has_friction(effects: tuple[Any, ...]) -> bool:
    """Return whether balls have friction on the race, and may stick."""
    return any_has(effects, "friction_coefficient")


def has_contact(effects: tuple[Any, ...]) -> bool:
    """Return whether balls touch each other."""
    return any_has(effects, "restitution")


def has_motor(effects: tuple[Any, ...]) -> bool:
    """Return whether a motor drives the spindle."""
    return any_has(effects, "rotor_moment")


def has_events(effects: tuple[Any, ...]) -> bool:
    """Return whether an effect has a set-valued law, so that runs have events."""
    return any_has(effects, *EVENTFUL)


def eventful(effects: Mapping[str, Any]) -> dict[str, str]:
    """Return the names of a scene's effects with set-valued laws, each with a text on its event."""
    return {
        name: what
        for name, effect in effects.items()
        for method, what in EVENTFUL.items()
        if hasattr(effect, method)
    }


def has_gravity(effects: tuple[Any, ...]) -> bool:
    """Return whether an effect is gravity."""
    return any_has(effects, "gravity")


def has_spin(effects: tuple[Any, ...]) -> bool:
    """Return whether balls roll."""
    return any_has(effects, "ball_inertia")


def has_stiffening(effects: tuple[Any, ...]) -> bool:
    """Return whether mounts harden."""
    return any_has(effects, "mount_stiffening")


def rotor_moment(effects: tuple[Any, ...]) -> float:
    """Return I_r of the motor's rotor [kg m^2]; 0 without a motor."""
    return float(over_effects(effects, "rotor_moment", 0.0))


def has_spindle_angle(system: System) -> bool:
    """Return whether the equations contain the spindle's angle."""
    turned = any_has(system.effects, "space_force", "gravity")
    return bool(type(system.deck_model).NEEDS_ANGLE or turned)


_MOTOR_NAMES = ("spindle angle", "spindle speed", "speed loop's integral")
_ENERGY_BALANCE_NAMES = ("motor work", "energy dissipated")


class StateLayout(NamedTuple):
    """Positions of quantities in a system's state, for Python."""

    names: tuple[str, ...]
    """Names of all states."""
    deck: slice
    """Positions of the deck's states; the deck model's class has their names."""
    angles: slice
    """Positions of theta_i."""
    rates: slice
    """Positions of theta_i'."""
    spindle: slice
    """Positions of psi, w and the speed loop's integral; empty without a motor."""
    energy_balance: slice
    """Positions of motor work and dissipated energy; empty without an energy balance."""

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.names)


def layout_of(system: System) -> StateLayout:
    """Return the positions of quantities in the state of a system."""
    deck_names, n = type(system.deck_model).STATE_NAMES, len(system.balls)
    return _layout(deck_names, n, bool(has_motor(system.effects)), bool(system.energy_balance))


@functools.lru_cache
def _layout(deck_names: tuple[str, ...], n: int, motor: bool, energy_balance: bool) -> StateLayout:
    names = [
        *deck_names,
        *(f"ball_{i} angle" for i in range(n)),
        *(f"ball_{i} rate" for i in range(n)),
    ]
    angles, rates = (
        slice(len(deck_names), len(deck_names) + n),
        slice(len(deck_names) + n, len(names)),
    )
    names += _MOTOR_NAMES if motor else ()
    spindle = slice(rates.stop, len(names))
    names += _ENERGY_BALANCE_NAMES if energy_balance else ()
    return StateLayout(
        tuple(names),
        slice(0, len(deck_names)),
        angles,
        rates,
        spindle,
        slice(spindle.stop, len(names)),
    )

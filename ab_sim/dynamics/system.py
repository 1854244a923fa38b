"""What moves, as numbers: constants of a scene, and the columns of its arrays."""

from collections.abc import Mapping
from math import inf
from typing import Any, NamedTuple

import numpy as np

from ab_sim.equations.race import BallConstants
from ab_sim.equations.sums import any_has, over_effects

MASS, RADIUS, ROLLING_MASS, MOBILITY, MOMENT, ROUND_LEVER, FIRST_TURNS = range(7)
RACE_RADIUS, RACE_CURVATURE, RACE_HEIGHT = 7, 8, 9
"""Columns of System.balls: m_i [kg]; a_i [m]; mu_i = m_i + I_i/a_i^2 [kg], I_i = 0 where balls do
not roll; 1/mu_i; m_i R [kg m]; m_i R - (I_i/a_i^2) a_i [kg m], what the spindle's acceleration asks
of the ball along a round race; whole turns in the ball's angle at the start; of its race R [m], 1/R
and the height along the shaft [m]."""
BALL_CONSTANTS = 10
ORDER, SPACING = 0, 1
"""Columns of System.contacts: the ball at this place of the row; the distance along the race from
it to the next one in contact [m]."""
DIRECTION, LOADED, JOINED, TURNS = 0, 1, 2, 3
"""Columns of the discrete state, the branches of set-valued laws that hold between two events.

DIRECTION: +1 or -1, in which a ball slides along the race; 0, it sticks, or it is held between
others. Of the last row: +1 or -1 while the motor gives all it can in that direction, else 0.
LOADED: 1 where the race carries the ball. JOINED: 1 where the two balls at a contact touch and
stay so: both slide, or both stick. TURNS: whole turns taken out of a ball's angle; of the last
row, out of the spindle's."""
DISCRETE_COLUMNS = 4
FORMULA_COLUMNS = (
    *(MASS, RADIUS, ROLLING_MASS, MOBILITY, MOMENT, ROUND_LEVER),
    *(RACE_RADIUS, RACE_CURVATURE, RACE_HEIGHT),
)
"""Columns of System.balls, in the order of ``equations.race.BallConstants``."""
EVENTFUL = {
    "friction_coefficient": "balls stick and slip",
    "restitution": "balls collide",
    "rotor_moment": "a motor reaches its limit",
}
"""Methods of effects with set-valued laws, which have events; and what happens there."""


class System(NamedTuple):
    """Constants of a scene. An effect that is not in ``effects`` is not computed."""

    deck_model: Any
    """Deck and rotor: an instance of a deck model, see ``ab_sim.equations.planar``."""
    balls: np.ndarray
    """Shape (n, BALL_CONSTANTS), columns as above."""
    contacts: np.ndarray
    """Neighbours along the race, shape (n, 2), columns as above; contact k lies between the balls
    at places k and k + 1 of the row, cyclic. Shape (0, 2) if balls may pass each other."""
    effects: tuple[Any, ...]
    energy_balance: bool = False
    """Whether motor work and losses are integrated along with the motion."""

    def mechanical_energy(self, state: Any, psi: float, speed: float) -> float:
        """Kinetic and stored energy [J]; of the rotor's inertia I_r only what a motor accelerates.

        Args:
            state: its state.
            psi: spindle angle [rad].
            speed: spindle speed [rad/s].
        """
        balls = BallConstants(len(self.balls), *constants_of_balls(self))
        at = np.asarray(state, float)
        return float(self.deck_model.energy(self.effects, balls, at, float(psi), float(speed)))


class ActiveSegment(NamedTuple):
    """Where a run is along the speed profile."""

    segment: Any
    """Speed segment in force."""
    phase: float
    """Spindle angle at the segment's beginning [rad], whole turns left out."""
    until: float = inf
    """Local time at which the segment ends [s]."""
    angle: float = 0.0
    """Spindle angle at the segment's beginning [rad], with all its turns: for samples."""


def constants_of_balls(system: System) -> np.ndarray:
    """Those that formulas take, shape (columns of ``BallConstants``, n)."""
    return system.balls.T[list(FORMULA_COLUMNS)]


def has_friction(effects: tuple[Any, ...]) -> bool:
    """Whether balls rub on the race, and may stick."""
    return any_has(effects, "friction_coefficient")


def has_contact(effects: tuple[Any, ...]) -> bool:
    """Whether balls touch each other."""
    return any_has(effects, "restitution")


def has_motor(effects: tuple[Any, ...]) -> bool:
    """Whether a motor drives the spindle."""
    return any_has(effects, "rotor_moment")


def has_events(effects: tuple[Any, ...]) -> bool:
    """Whether there are set-valued laws."""
    return any_has(effects, *EVENTFUL)


def eventful(effects: Mapping[str, Any]) -> dict[str, str]:
    """Those of a scene's effects, by name, that have set-valued laws; what happens there."""
    return {
        name: what
        for name, effect in effects.items()
        for method, what in EVENTFUL.items()
        if hasattr(effect, method)
    }


def has_gravity(effects: tuple[Any, ...]) -> bool:
    """Whether something weighs."""
    return any_has(effects, "gravity")


def has_spin(effects: tuple[Any, ...]) -> bool:
    """Whether balls roll."""
    return any_has(effects, "ball_inertia")


def has_stiffening(effects: tuple[Any, ...]) -> bool:
    """Whether mounts harden."""
    return any_has(effects, "mount_stiffening")


def rotor_moment(effects: tuple[Any, ...]) -> float:
    """I_r of the motor's rotor [kg m^2]; 0 without a motor."""
    return float(over_effects(effects, "rotor_moment", 0.0))


def has_spindle_angle(system: System) -> bool:
    """Whether the equations contain the spindle's angle."""
    turned = any_has(system.effects, "space_force", "gravity")
    return bool(type(system.deck_model).NEEDS_ANGLE or turned)

"""Equations of resting states, for scenes without friction and contact."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.held_speed import held
from ab_sim.base.errors import SceneError
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.registry import require_built_in
from ab_sim.model.dynamics.system import (
    DISCRETE_COLUMNS,
    MASS,
    MOMENT,
    RACE_RADIUS,
    ROLLING_MASS,
    StateLayout,
    System,
    has_spindle_angle,
    layout_of,
)
from ab_sim.model.equations.effects import HardeningSuspension, Suspension
from ab_sim.model.spindle import ScheduledSegment, SpeedSchedule
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Spindle, Start

LEFT_OUT = ("rolling_friction", "race_friction", "ball_contact")
"""Effects that are set-valued where balls rest; stability verdicts exclude them."""
_LEAVES_REST = frozenset(
    {"ball_drag", "ball_inertia", "friction_coefficient", "restitution", "spindle_acceleration"}
)
"""Methods of effects that do not move resting states.

Any other method may, including those of user-defined effects; states are then found numerically.
"""


def resting_system(scene: Scene) -> System:
    """Return the smooth system of a scene whose equations do not contain the spindle's angle.

    Effects in ``LEFT_OUT`` are removed. Gravity is removed as well if it has no component across
    the shaft of a planar deck.

    Raises
    ------
    SceneError
        The deck model is not a built-in one, the spindle's angle is in the equations, or its speed
        is a state.
    """
    require_built_in(scene, "the search for resting states")
    smooth = without_events(scene)
    gravity = smooth.effects.get("gravity")
    if scene.deck is None and gravity is not None and not any(gravity.gravity()):
        others = {name: effect for name, effect in smooth.effects.items() if name != "gravity"}
        smooth = smooth.model_copy(update={"effects": others})
    system = held(smooth, 0.0).system
    if has_spindle_angle(system):
        raise SceneError(
            f"{_what_turns(smooth)}: the spindle's angle is in the equations, so that there are "
            "periodic motions instead of resting states; use ab-sim floquet, or remove it from "
            "the scene"
        )
    return system


def without_events(scene: Scene) -> Scene:
    """Return the scene without the effects in ``LEFT_OUT``."""
    effects = {name: effect for name, effect in scene.effects.items() if name not in LEFT_OUT}
    return scene.model_copy(update={"effects": effects})


def running_at(scene: Scene, speed: float, ball_angles: tuple[float, ...] | None = None) -> Scene:
    """Return a scene ``without_events`` that runs at a constant speed from its start.

    Parameters
    ----------
    scene
        Scene; its profile and requested accuracy are removed.
    speed
        Spindle speed w [rad/s].
    ball_angles
        Start angles [rad]; None for the default ones.
    """
    spindle = Spindle(
        max_speed=max(scene.spindle.max_speed, abs(speed)),
        max_acceleration=scene.spindle.max_acceleration,
    )
    start = Start(speed=speed, ball_angles=ball_angles)
    changes = {"start": start, "spindle": spindle, "profile": None, "accuracy": None}
    return without_events(scene).model_copy(update=changes)


def _what_turns(scene: Scene) -> str:
    """Return the keys of a scene that may bring the spindle's angle into the equations."""
    if scene.deck is not None:
        return "deck"
    names = [
        f"effects.{name}"
        for name, effect in scene.effects.items()
        if hasattr(effect, "space_force") or hasattr(effect, "gravity")
    ]
    return ", ".join(names) or "deck_model"


def constant(speed: float) -> ScheduledSegment:
    """Return the schedule's segment of a constant spindle speed [rad/s], from t = 0 on."""
    return SpeedSchedule.constant(speed).segment_at(0.0)


def field_at(system: System, speed: float) -> VectorField:
    """Return the equations of a ``resting_system`` at a constant speed [rad/s]."""
    branches = np.zeros((len(system.balls) + 1, DISCRETE_COLUMNS), np.int64)
    return VectorField(system, constant(speed), branches)


def state_of(system: System, speed: float, u: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return the state of deck and balls at rest on the rotating axes, shape (states,).

    Parameters
    ----------
    system
        Planar system.
    speed
        Spindle speed w [rad/s].
    u
        Displacement of the deck on the rotating axes [m], shape (2,). Its velocity is w J u.
    theta
        Ball angles from the unbalance [rad], shape (n,).
    """
    layout: StateLayout = layout_of(system)
    state = np.zeros(layout.size)
    state[layout.deck] = u[0], u[1], -speed * u[1], speed * u[0]
    state[layout.angles] = theta
    return state


class ClosedFormRotor(NamedTuple):
    """Parameters of the closed forms: a round race in an isotropic suspension."""

    mass: float
    """Total mass M [kg]."""
    unbalance: float
    """Unbalance M0 e [kg m]."""
    stiffness: float
    """Stiffness k [N/m]."""
    damping: float
    """Damping c [N s/m]."""
    cubic_stiffness: float
    """Cubic stiffness k_3 [N/m^3]."""
    moments: tuple[float, ...]
    """Moment m_i R of each ball [kg m]."""
    kinds: tuple[int, ...]
    """Kind of each ball, counted from 0; equal balls share a number."""


def rotor_of(system: System) -> ClosedFormRotor | None:
    """Return the parameters of the closed forms; None if another effect may move resting states."""
    moved = any(may_move_rest(effect) for effect in system.effects)
    return None if moved else base_rotor_of(system)


def may_move_rest(effect: Any) -> bool:
    """Return whether an effect may shift resting states from the closed forms.

    It may if its class has a public method other than those in ``_LEAVES_REST``.
    """
    if isinstance(effect, Suspension | HardeningSuspension):
        return False
    callables = {name for name, value in vars(type(effect)).items() if callable(value)}
    public = {name for name in callables if not name.startswith("_")}
    return bool(public - {"check_scene"} - _LEAVES_REST)


def base_rotor_of(system: System) -> ClosedFormRotor:
    """Return the parameters of the closed forms, ignoring effects without a closed form."""
    stiffness = damping = cubic = 0.0
    for effect in system.effects:
        if isinstance(effect, Suspension):
            stiffness, damping = effect.stiffness, effect.damping
        elif isinstance(effect, HardeningSuspension):
            cubic = effect.cubic_stiffness
    return ClosedFormRotor(
        system.deck_model.total_mass,
        system.deck_model.unbalance,
        stiffness,
        damping,
        cubic,
        tuple(system.balls[:, MOMENT].tolist()),
        kinds_of(system),
    )


def kinds_of(system: System) -> tuple[int, ...]:
    """Return the kind of each ball, counted from 0; balls of equal mass and radius share a kind."""
    numbers_by_kind: dict[tuple[float, ...], int] = {}
    columns = system.balls[:, [MASS, ROLLING_MASS, RACE_RADIUS]]
    return tuple(
        numbers_by_kind.setdefault(tuple(row), len(numbers_by_kind)) for row in columns.tolist()
    )

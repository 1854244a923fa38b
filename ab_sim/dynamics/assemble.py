"""Conversion of a scene to the system that a kernel runs, its start, and its fastest decay rate."""

import functools

import numpy as np

from ab_sim.dynamics import registry
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.linearised import Linearised
from ab_sim.dynamics.own_motion import DAMPINGS
from ab_sim.dynamics.system import (
    BALL_CONSTANTS,
    DISCRETE_COLUMNS,
    FIRST_TURNS,
    JOINED,
    LOADED,
    MASS,
    RADIUS,
    ROLLING_MASS,
    SPACING,
    TURNS,
    ActiveSegment,
    System,
    has_motor,
    has_spin,
    rotor_moment,
)
from ab_sim.equations.motion import Ball
from ab_sim.equations.neighbours import contacts_of, reduced, start_angles, start_gaps
from ab_sim.equations.sums import over_effects
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene
from ab_sim.spindle import ScheduledSegment


def system_of(scene: Scene, energy_balance: bool = False) -> System:
    """Return the system of a scene: constants and effects.

    Args:
        scene: a checked scene.
        energy_balance: whether motor work and losses are integrated along with the motion.
    """
    effects = tuple(scene.effects.values())
    deck_model = registry.of_scene(scene).make(scene, effects)
    balls = _balls(scene, effects)
    return System(deck_model, balls, contacts_of(scene), effects, energy_balance)


def _balls(scene: Scene, effects: tuple[object, ...]) -> np.ndarray:
    """Return ``System.balls``."""
    rows = [
        (*of_ball(Ball(m, a), scene.race.radius, effects), scene.race.heights[race])
        for m, a, race in zip(scene.balls.masses, scene.balls.radii, scene.balls.races, strict=True)
    ]
    found = np.array(rows).reshape(len(rows), BALL_CONSTANTS)
    found[:, FIRST_TURNS] = [reduced(angle)[1] for angle in start_angles(scene)]
    return found


def of_ball(ball: Ball, radius: float, effects: tuple[object, ...]) -> tuple[float, ...]:
    """Return the constants of a ball, columns of ``System.balls`` except the height, with no turns.

    Args:
        ball: its mass and radius.
        radius: radius of the race [m].
        effects: the scene's effects. Their numbers and the ball's may be columns, shape (runs,).
    """
    m, a = ball
    spin = over_effects(effects, "ball_inertia", 0.0, ball)
    lever = m * radius - spin * a if has_spin(effects) else m * radius
    return (m, a, m + spin, 1.0 / (m + spin), m * radius, lever, 0.0, radius, 1.0 / radius)


def start_state(scene: Scene, system: System) -> np.ndarray:
    """Return the state at t = 0."""
    layout = layout_of(system)
    state = np.zeros(layout.size)
    state[layout.deck] = registry.of_scene(scene).start(scene, system)
    if scene.start.ball_rates is not None:
        state[layout.rates] = scene.start.ball_rates
    state[layout.angles] = [reduced(angle)[0] for angle in start_angles(scene)]
    if has_motor(system.effects):
        state[layout.spindle] = reduced(scene.start.angle)[0], scene.start.speed, 0.0
    return state


def start_discrete_state(scene: Scene, system: System) -> np.ndarray:
    """Return the initial branches, before they are settled, and the turns in the start angles."""
    n = system.balls.shape[0]
    discrete_state = np.zeros((n + 1, DISCRETE_COLUMNS), np.int64)
    discrete_state[:n, LOADED] = 1
    discrete_state[:n, TURNS] = system.balls[:, FIRST_TURNS]
    discrete_state[n, TURNS] = reduced(scene.start.angle)[1]
    for k, gap in enumerate(start_gaps(scene, len(system.contacts))):
        discrete_state[k, JOINED] = gap <= TOUCHING * system.contacts[k, SPACING]
    return discrete_state


def state_bounds(system: System, step: float) -> np.ndarray:
    """Return magnitudes that no sound run reaches; a state beyond them is invalid.

    They are a deck displacement of a thousand kilometres, or a ball that turns 3 rad along the race
    within one step, which no stepper can follow. Angles and energies grow without limit in sound
    runs.
    """
    layout = layout_of(system)
    bounds = np.full(layout.size, 1e150)
    bounds[layout.deck] = 1e6
    bounds[layout.rates] = 3.0 / step
    if has_motor(system.effects):
        bounds[layout.spindle.start + 1] = 3.0 / step
    return bounds


def linear_rates(system: System, top_speed: float) -> dict[str, complex]:
    """Return the fastest eigenvalues [1/s] of the linear parts, by name.

    Args:
        system: the system.
        top_speed: fastest spindle speed [rad/s]; the deck's whirl is faster by that on rotating
            axes.

    Raises:
        SceneError: a method of an effect returns numbers that are not finite.
    """
    effects = system.effects
    own = registry.of_system(system).rates(system, top_speed)
    rates = {DRAG: complex(-drag_rate(system)), **own}
    if has_motor(effects):
        moment = rotor_moment(effects)
        stiffness = over_effects(effects, "loop_torque", 0.0, 0.0, 1.0)
        loop = np.roots([moment, _motor_damping(system), stiffness])
        rates["the motor's speed loop"] = complex(max(loop, key=abs))
    for what, rate in rates.items():
        _check_finite(effects, what, rate)
    return rates


TOUCHING = 1e-12
"""Fraction of the distance between two centres that counts as touching; it is computed to 1e-14."""
DRAG = "the race's drag"
"""Key of the drag's rate in ``linear_rates``, which steppers for stiff drag treat separately."""


def _check_finite(effects: tuple[object, ...], what: str, numbers: complex | list[float]) -> None:
    if not np.isfinite(numbers).all():
        names = ", ".join(type(each).__name__ for each in effects)
        raise SceneError(
            f"effects: the rate of {what} is no finite number; a method of one of them gives "
            f"numbers that are none: {names}"
        )


def drag_rate(system: System) -> float:
    """Return the fastest decay rate [1/s] of a ball's speed along the race under the effects' drag.

    It is c_b/(m + I/a^2) for a ball on a fixed deck. A deck that is free to move reduces the
    effective mass of the balls, most if they are side by side, which is assumed here. The rate is
    then the largest eigenvalue of G^-1 c_b with G_ij = mu_i delta_ij - m_i m_j / M
    (docs/equations.md, 2). For a deck in space, the turning adds to 1 / M; the direction with the
    largest effect is taken.
    """
    n = system.balls.shape[0]
    if n == 0:
        return 0.0
    masses, inertia = system.balls[:, MASS], system.balls[:, ROLLING_MASS]
    balls = [Ball(m, a) for m, a in system.balls[:, [MASS, RADIUS]].tolist()]
    drag = [over_effects(system.effects, "ball_drag", 0.0, ball) for ball in balls]
    _check_finite(system.effects, DRAG, drag)
    fastest = 0.0
    for yields in registry.of_system(system).yields(system):
        coupled = np.diag(inertia) - masses[:, None] * masses * yields
        decays = np.linalg.eigvals(np.linalg.solve(coupled, np.diag(drag)))
        fastest = max(fastest, float(decays.real.max()))
    return fastest


def linearised(system: System) -> Linearised:
    """Return small motions of the deck about its position at rest.

    Raises:
        SceneError: there is no position at rest, or the deck model does not provide them.
    """
    return registry.of_system(system).linearised(system)


def own_motion(system: System) -> np.ndarray:
    """Return the linear motion of the carrier of the balls, see ``dynamics.own_motion``."""
    known = registry.of_system(system)
    found = known.own_motion(system)
    if has_motor(system.effects):
        column = type(system.deck_model).COORDINATES
        found[DAMPINGS, column] = _motor_damping(system) / known.spindle_inertia(system)
    return found


def _motor_damping(system: System) -> float:
    """Return the loss of a motor's torque per speed above the commanded one [N m s/rad]."""
    effects = system.effects
    asked = over_effects(effects, "loop_torque", 0.0, 1.0, 0.0)
    return float(asked + over_effects(effects, "back_torque", 0.0, 1.0))


@functools.lru_cache(maxsize=256)
def place_on(scheduled: ScheduledSegment) -> ActiveSegment:
    """Return the kernel's data of a segment of a speed profile."""
    phase, lasts = reduced(scheduled.start_angle)[0], float(scheduled.end - scheduled.start)
    return ActiveSegment(scheduled.segment, phase, lasts, float(scheduled.start_angle))

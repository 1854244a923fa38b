"""Convert a scene to the system that a kernel runs, with its initial state and fastest rates."""

import functools
import itertools
import math
from typing import Any

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.model.dynamics import registry
from ab_sim.model.dynamics.at_rest import Linearised
from ab_sim.model.dynamics.system import (
    DISCRETE_COLUMNS,
    FIRST_TURNS,
    JOINED,
    LOADED,
    MASS,
    RADIUS,
    ROLLING_MASS,
    SPACING,
    TURNS,
    System,
    constants_of_balls,
    has_motor,
    has_spin,
    layout_of,
    stacked,
)
from ab_sim.model.equations.motion import (
    ActiveSegment,
    Ball,
    BallConstants,
    SpindleMotion,
    on_race,
)
from ab_sim.model.equations.neighbours import contacts_of, reduced, start_angles, start_gaps
from ab_sim.model.equations.sums import over_effects
from ab_sim.model.spindle import ScheduledSegment
from ab_sim.scene.model import Scene


def system_of(scene: Scene, energy_balance: bool = False) -> System:
    """Return the system of a scene: constants and effects.

    Parameters
    ----------
    scene
        A checked scene. Its masses, eccentricity, race's radius, start angles and effects' numbers
        may be columns of runs, shape (runs,), for a planar deck without gravity, contact and motor.
    energy_balance
        True to integrate motor work and losses along with the motion.
    """
    effects = tuple(scene.effects.values())
    deck_model = registry.of_scene(scene).make(scene, effects)
    balls = _balls(scene, effects)
    return System(deck_model, balls, contacts_of(scene), effects, energy_balance)


def _balls(scene: Scene, effects: tuple[object, ...]) -> np.ndarray:
    """Return the constants of all balls, ``System.balls``."""
    balls, race = scene.balls, scene.race
    columns = zip(balls.masses, balls.radii, balls.races, start_angles(scene), strict=True)
    rows = [
        (*of_ball(Ball(m, a), race.radius, race.heights[k], effects)[1:], reduced(angle)[1])
        for m, a, k, angle in columns
    ]
    constants = stacked(itertools.chain.from_iterable(rows))
    return constants.reshape(len(rows), FIRST_TURNS + 1, *constants.shape[1:])


def of_ball(ball: Ball, radius: float, height: float, effects: tuple[object, ...]) -> BallConstants:
    """Return the constants of one ball.

    Parameters
    ----------
    ball
        Mass [kg] and radius [m] of the ball.
    radius
        Radius of the race [m].
    height
        Height of the race along the shaft [m].
    effects
        The scene's effects.
    """
    m, a = ball
    spin = over_effects(effects, "ball_inertia", 0.0, ball)
    lever = m * radius - spin * a if has_spin(effects) else m * radius
    mobility, curvature = 1.0 / (m + spin), 1.0 / radius
    return BallConstants(1, m, a, m + spin, mobility, m * radius, lever, radius, curvature, height)


def start_state(scene: Scene, system: System) -> np.ndarray:
    """Return the state at t = 0, in the order of ``layout_of``; with columns (runs, states)."""
    layout = layout_of(system)
    state = np.zeros((*system.balls.shape[2:], layout.size))
    state[..., layout.deck] = registry.of_scene(scene).start(scene, system)
    if scene.start.ball_rates is not None:
        state[..., layout.rates] = scene.start.ball_rates
    state[..., layout.angles] = np.array([reduced(angle)[0] for angle in start_angles(scene)]).T
    if has_motor(system.effects):
        start = scene.start
        state[layout.spindle] = reduced(start.angle)[0], start.speed, start.motor_integral
    return state


def start_discrete_state(scene: Scene, system: System) -> np.ndarray:
    """Return the discrete state at t = 0, whose branches the first step may correct.

    With columns, the first axis is the run.
    """
    n, runs = len(system.balls), system.balls.shape[2:]
    discrete_state = np.zeros((*runs, n + 1, DISCRETE_COLUMNS), np.int64)
    discrete_state[..., :n, LOADED] = 1
    discrete_state[..., :n, TURNS] = system.balls[:, FIRST_TURNS].T
    discrete_state[..., n, TURNS] = reduced(scene.start.angle)[1]
    for k, gap in enumerate(start_gaps(scene, len(system.contacts))):
        discrete_state[k, JOINED] = gap <= TOUCHING * system.contacts[k, SPACING]
    return discrete_state


def state_bounds(system: System, step: float) -> np.ndarray:
    """Return the largest valid magnitude of each state; beyond it, a run has diverged.

    A deck may move by a thousand kilometres. A ball or a spindle may turn by 3 rad within one step;
    no stepper can follow more. Energies grow without limit in valid runs; their bound only keeps
    them finite.

    Parameters
    ----------
    system
        The system.
    step
        Integration step [s].
    """
    layout = layout_of(system)
    bounds = np.full(layout.size, 1e150)
    bounds[layout.deck] = 1e6
    bounds[layout.angles] = MOST_ANGLE
    bounds[layout.rates] = 3.0 / step
    if has_motor(system.effects):
        bounds[layout.spindle.start : layout.spindle.start + 2] = MOST_ANGLE, 3.0 / step
    return bounds


def linear_rates(system: System, top_speed: float) -> dict[str, Any]:
    """Return the fastest eigenvalues [1/s] of the linear parts of the equations, by name.

    They are complex numbers, or columns of them.

    Parameters
    ----------
    system
        The system.
    top_speed
        Largest spindle speed [rad/s]; on rotating axes, the deck's whirl is faster by this speed.

    Raises
    ------
    SceneError
        A method of an effect returns numbers that are not finite.
    """
    effects = system.effects
    deck_rates = registry.of_system(system).rates(system, top_speed)
    rates = {DRAG: -drag_rate(system) + 0j, **deck_rates}
    if has_motor(effects):
        rates |= _motor_rates(system, rates[DRAG])
    for what, rate in rates.items():
        _check_finite(effects, what, rate)
    return rates


TOUCHING = 1e-12
"""Largest gap between touching balls, as a fraction of the distance between their centres. Gaps are
computed with an error of about 1e-14."""
MOST_ANGLE = 1e15
"""Largest angle [rad]; beyond it, a double cannot resolve parts of a turn."""
DRAG = "the race's drag"
"""Key of the drag's rate in ``linear_rates``. Steppers for stiff drag are not limited by it."""
LOOP = "the motor's speed loop"
"""Key of the motor's rate in ``linear_rates``."""


def _check_finite(effects: tuple[object, ...], what: str, numbers: Any) -> None:
    """Refuse rates that are not finite, which a user's effect may return."""
    if not np.isfinite(numbers).all():
        names = ", ".join(type(effect).__name__ for effect in effects)
        raise SceneError(
            f"effects: the rate of {what} is not a finite number; a method of one of these "
            f"effects returns NaN or infinity: {names}"
        )


def drag_rate(system: System) -> Any:
    """Return the fastest decay rate [1/s] of a ball's speed along the race under the effects' drag.

    It is c_b/(m + I/a^2) for a ball on a fixed deck. A deck that is free to move reduces the
    effective mass of the balls, most if they are side by side, which is assumed here. The rate is
    then the largest eigenvalue of G^-1 c_b with G_ij = mu_i delta_ij - m_i m_j / M
    (docs/equations.md, 2). For a deck in space, its rotation adds to 1 / M; the position of the
    balls at which it adds most is taken.
    """
    if not len(system.balls):
        return 0.0
    masses, inertia = system.balls[:, MASS].T, system.balls[:, ROLLING_MASS].T
    drag, fastest, diagonal = _drag(system).T, 0.0, np.eye(len(system.balls))
    for yields in registry.of_system(system).yields(system):
        coupled = inertia[..., None] * diagonal - masses[..., None] * masses[..., None, :] * yields
        decays = np.linalg.eigvals(np.linalg.solve(coupled, drag[..., None] * diagonal))
        fastest = np.maximum(fastest, decays.real.max(axis=-1))
    return fastest


def _drag(system: System) -> np.ndarray:
    """Return the drag coefficient of each ball [N s/m]; with columns, shape (balls, runs)."""
    balls = system.balls[:, [MASS, RADIUS]]
    # Effects that branch on a number take floats only.
    rows = balls.tolist() if balls.ndim == 2 else balls
    drag = stacked(over_effects(system.effects, "ball_drag", 0.0, Ball(*row)) for row in rows)
    _check_finite(system.effects, DRAG, drag)
    return drag


def _motor_rates(system: System, drag_alone: complex) -> dict[str, complex]:
    """Return the rates of a motor's speed loop and of the drag [1/s], which act on each other.

    The drag accelerates a rotor that is free to turn, as it does the deck. Unbalance and deck
    reduce the rotor's effective inertia. At these rates the suspension's forces are negligible. All
    balls are taken at one angle, at which the rates are largest.
    """
    effects, n = system.effects, len(system.balls)
    drag = _drag(system)
    stiffness = float(over_effects(effects, "loop_torque", 0.0, 0.0, 1.0))
    alone, together = 0j, 0j
    for along in np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False) if n else (0.0,):
        masses = _mass_matrix(system, along)
        spindle, size = len(masses) - n - 1, len(masses)
        for of_balls in (np.zeros(n), drag):
            damping = np.zeros(size)
            damping[spindle], damping[spindle + 1 :] = _motor_damping(system), of_balls
            # The state consists of the velocities and the integral of the spindle's velocity.
            matrix = np.zeros((size + 1, size + 1))
            matrix[:size, :size] = np.diag(-damping)
            matrix[spindle, size], matrix[size, spindle] = -stiffness, 1.0
            matrix[:size] = np.linalg.solve(masses, matrix[:size])
            fastest = complex(max(np.linalg.eigvals(matrix), key=abs))
            if of_balls is drag:
                together = max(together, fastest, key=abs)
            else:
                alone = max(alone, fastest, key=abs)
    # Loop and drag both act in the fastest motion. It is named after the one that is faster alone.
    if abs(alone) >= abs(drag_alone):
        return {LOOP: together, DRAG: drag_alone}
    return {LOOP: alone, DRAG: together}


def _mass_matrix(system: System, along: float) -> np.ndarray:
    """Return the mass matrix of deck, spindle and balls along the race, all balls at one angle."""
    effects, n = system.effects, len(system.balls)
    balls = BallConstants(n, *constants_of_balls(system))
    ones = np.ones(n)
    on = on_race(effects, balls, math.cos(along) * ones, math.sin(along) * ones, 0.0 * ones)
    still = SpindleMotion(0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    model = type(system.deck_model)
    state = [0.0] * len(model.STATE_NAMES)
    if model.UNIT_AT >= 0:
        state[model.UNIT_AT] = 1.0
    arrow = system.deck_model.arrow(effects, balls, on, still, state)
    upper = np.triu(np.array(arrow.block, float))
    coupling = np.array([coefficient * ones for coefficient in arrow.coupling])
    rolling = np.diag(system.balls[:, ROLLING_MASS])
    return np.block([[upper + np.triu(upper, 1).T, -coupling], [-coupling.T, rolling]])


def linearised(system: System) -> Linearised:
    """Return the linear equations of the deck's small motions about its position at rest.

    Raises
    ------
    SceneError
        There is no position at rest, or the deck model does not provide them.
    """
    return registry.of_system(system).linearised(system)


def free_coordinates(system: System) -> tuple[str, ...]:
    """Return the coordinates along which no force restores the deck; empty if they are unknown."""
    try:
        return linearised(system).free
    except SceneError:
        return ()


def _motor_damping(system: System) -> float:
    """Return the decrease of the motor's torque per increase of the spindle speed [N m s/rad]."""
    effects = system.effects
    loop = over_effects(effects, "loop_torque", 0.0, 1.0, 0.0)
    return float(loop + over_effects(effects, "back_torque", 0.0, 1.0))


@functools.lru_cache(maxsize=256)
def active_segment(scheduled: ScheduledSegment) -> ActiveSegment:
    """Return a segment of a schedule with the numbers that a kernel needs.

    The result is cached, because every step plan and every batch converts the same few segments.
    """
    phase, lasts = reduced(scheduled.start_angle)[0], float(scheduled.end - scheduled.start)
    return ActiveSegment(scheduled.law, phase, lasts, float(scheduled.start_angle))

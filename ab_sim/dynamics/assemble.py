"""From a scene to the system that a kernel runs, its start, and its fastest decay rate."""

import math

import numpy as np
from scipy.optimize import root

from ab_sim.dynamics.ledger import Ledger, deck_energy, ledger_states, space_energy
from ab_sim.dynamics.motion import Ball, Body, Deck
from ab_sim.dynamics.neighbours import contacts_of, reduced, start_angles
from ab_sim.dynamics.switches import TOUCHING, gap
from ab_sim.dynamics.system import (
    FIRST_TURNS,
    JOINED,
    LOADED,
    MASS,
    MODES,
    RADIUS,
    SPACING,
    TURNS,
    Place,
    System,
    back_torque,
    ball_drag,
    ball_inertia,
    deck_force,
    gravity,
    has_events,
    has_gravity,
    has_motor,
    has_spin,
    loop_torque,
    rotor_moment,
    space_force,
)
from ab_sim.errors import SceneError, exact
from ab_sim.scene.model import Scene
from ab_sim.spindle import Piece

_DECK_STATES = ("u1", "u2", "v1", "v2")
_MOTOR_STATES = ("spindle angle", "spindle speed", "speed loop's integral")


def system_of(scene: Scene, ledger: bool = False) -> System:
    """The system of a scene: constants, and its effects.

    Args:
        scene: a checked scene.
        ledger: whether motor work and losses are integrated along with the motion.
    """
    eccentricity = scene.rotor.eccentricity
    effects = tuple(scene.effects.values())
    sag_x, sag_y = _sag(scene.total_mass, effects)
    body = Body(
        total_mass=scene.total_mass,
        unbalance=scene.eccentric_mass * eccentricity,
        eccentricity=eccentricity,
        race_radius=scene.race.radius,
        race_curvature=1.0 / scene.race.radius,
        sag_x=sag_x,
        sag_y=sag_y,
    )
    balls = _balls(scene, effects)
    kept = (Ledger(),) if ledger else ()
    # Events make kernels so large that one for each number of balls would take too long to compile.
    each = len(balls) if has_events(effects) else (None,) * len(balls)
    return System(body, balls, contacts_of(scene), effects, kept, each)


def _balls(scene: Scene, effects: tuple[object, ...]) -> np.ndarray:
    """``System.balls``."""
    angles, radius = start_angles(scene), scene.race.radius
    rows = []
    for m, a, angle in zip(scene.balls.masses, scene.balls.radii, angles, strict=True):
        spin = ball_inertia(effects, Ball(m, a))
        lever = m * radius - spin * a if has_spin(effects) else m * radius
        rows.append((m, a, m + spin, 1.0 / (m + spin), m * radius, lever, reduced(angle)[1]))
    return np.array(rows).reshape(len(rows), FIRST_TURNS + 1)


def _sag(mass: float, effects: tuple[object, ...]) -> tuple[float, float]:
    """Where the deck hangs at rest under gravity, from the suspension's unloaded position [m]."""
    if not has_gravity(effects):
        return 0.0, 0.0
    weight = mass * np.array(gravity(effects))
    if not weight.any():
        return 0.0, 0.0

    def unbalanced(place: np.ndarray) -> np.ndarray:
        deck = Deck(float(place[0]), float(place[1]), 0.0, 0.0)
        force = np.array(deck_force(effects, deck)) + np.array(space_force(effects, deck))
        return np.asarray((force + weight) / np.hypot(*weight))

    # Down the weight until the springs have stored as much as it has done work.
    reach = 1e-9
    while _stored(effects, reach * weight / np.hypot(*weight)) < reach * np.hypot(*weight):
        reach *= 2.0
        if reach > 1e6:
            raise SceneError(
                "effects.gravity: the suspension does not hold the deck's weight within 1000 km; "
                "stiffen it"
            )
    found = root(unbalanced, reach / 2 * weight / np.hypot(*weight), tol=1e-15)
    if np.abs(unbalanced(found.x)).max() > 1e-9:
        raise SceneError(
            "effects.gravity: no place was found where the suspension holds the deck's weight; "
            "give it stiffness in every direction"
        )
    return float(found.x[0]), float(found.x[1])


def _stored(effects: tuple[object, ...], place: np.ndarray) -> float:
    deck = Deck(float(place[0]), float(place[1]), 0.0, 0.0)
    return float(deck_energy(effects, deck) + space_energy(effects, deck))


def start_state(scene: Scene, system: System) -> np.ndarray:
    """The state at t = 0: deck at rest, balls at rest on the race at the scene's angles.

    At rest in space, the deck's velocity on the rotating axes is zero at any speed.
    """
    n = system.balls.shape[0]
    state = np.zeros(len(state_names(system)))
    state[4 : 4 + n] = [reduced(angle)[0] for angle in start_angles(scene)]
    if has_motor(system.effects):
        state[4 + 2 * n] = reduced(scene.start.angle)[0]
        state[5 + 2 * n] = scene.start.speed
    return state


def start_modes(scene: Scene, system: System) -> np.ndarray:
    """Branches to begin with, before they are settled, and the turns in the start angles."""
    n = system.balls.shape[0]
    modes = np.zeros((n + 1, MODES), np.int64)
    modes[:n, LOADED] = 1
    modes[:n, TURNS] = system.balls[:, FIRST_TURNS]
    modes[n, TURNS] = reduced(scene.start.angle)[1]
    state = start_state(scene, system)
    for k, spacing in enumerate(system.contacts[:, SPACING]):
        modes[k, JOINED] = gap(system, state, modes, k) <= TOUCHING * spacing
    return modes


def state_names(system: System) -> list[str]:
    """A name for each entry of the state, for messages."""
    n = system.balls.shape[0]
    names = [*_DECK_STATES]
    names += [f"ball_{i} angle" for i in range(n)] + [f"ball_{i} rate" for i in range(n)]
    if has_motor(system.effects):
        names += _MOTOR_STATES
    return names + ["motor work", "energy dissipated"][: ledger_states(system.ledger)]


def state_bounds(system: System, step: float) -> np.ndarray:
    """Magnitudes that no sound run reaches; beyond them the state is nonsense.

    A deck that has gone a thousand kilometres, or a ball that turns 3 rad along the race within
    one step, which no stepper can follow. Angles and energies grow without limit in sound runs.
    """
    n = system.balls.shape[0]
    bounds = np.full(len(state_names(system)), 1e150)
    bounds[:4] = 1e6
    bounds[4 + n : 4 + 2 * n] = 3.0 / step
    if has_motor(system.effects):
        bounds[4 + 2 * n + 1] = 3.0 / step
    return bounds


def linear_rates(system: System, top_speed: float) -> dict[str, complex]:
    """The fastest eigenvalues [1/s] of the linear parts, by what they belong to.

    Args:
        system: the System.
        top_speed: fastest spindle speed [rad/s]: in its frame, the deck's whirl turns that much
            faster.
    """
    body, effects = system.body, system.effects
    mass = body.total_mass - float(system.balls[:, MASS].sum())
    poles = np.concatenate(
        [
            np.roots([mass, *_resistance(effects, body, along)])
            for along in np.linspace(0.0, math.pi, 8, endpoint=False)
        ]
    )
    turning = [pole + 1j * (top_speed if pole.imag >= 0 else -top_speed) for pole in poles]
    rates = {
        DRAG: complex(-drag_rate(system)),
        f"the deck's whirl at {exact(top_speed)} rad/s": complex(max(turning, key=abs)),
    }
    if has_motor(effects):
        moment = rotor_moment(effects)
        damping = loop_torque(effects, 1.0, 0.0) + back_torque(effects, 1.0)
        loop = np.roots([moment, damping, loop_torque(effects, 0.0, 1.0)])
        rates["the motor's speed loop"] = complex(max(loop, key=abs))
    return rates


DRAG = "the race's drag"
"""Key of the drag's rate in ``linear_rates``: what a stepper for stiff drag takes care of."""


def _resistance(effects: tuple[object, ...], body: Body, along: float) -> tuple[float, float]:
    """Damping and stiffness against small displacements from rest in one direction."""
    c, s = math.cos(along), math.sin(along)
    # Far enough from rest for a cubic spring to count: as far as the deck hangs, or 10 e.
    far = max(10.0 * body.eccentricity, math.hypot(body.sag_x, body.sag_y), 1e-9)

    def resisting(moved: Deck) -> float:
        f, g = deck_force(effects, moved), space_force(effects, moved)
        return float(-(c * (f[0] + g[0]) + s * (f[1] + g[1])))

    stiffness = (
        resisting(Deck(far * c, far * s, 0.0, 0.0)) - resisting(Deck(-far * c, -far * s, 0.0, 0.0))
    ) / (2.0 * far)
    return resisting(Deck(0.0, 0.0, c, s)), stiffness


def drag_rate(system: System) -> float:
    """Fastest decay rate [1/s] of a ball's speed along the race under the effects' drag.

    c_b/(m + I/a^2) for a ball on a fixed deck. A deck that is free to move lightens the balls;
    they are lightest side by side, so that is assumed: the largest eigenvalue of G^-1 c_b with
    G_ij = mu_i delta_ij - m_i m_j / M (EQUATIONS.md section 1, A eliminated).
    """
    n = system.balls.shape[0]
    if n == 0:
        return 0.0
    body, masses = system.body, system.balls[:, MASS]
    balls = [Ball(m, a) for m, a in system.balls[:, [MASS, RADIUS]]]
    drag = np.array([ball_drag(system.effects, ball) for ball in balls])
    inertia = np.array([b.mass + ball_inertia(system.effects, b) for b in balls])
    coupled = np.diag(inertia) - np.outer(masses, masses) / body.total_mass
    return float(np.max(np.linalg.eigvals(np.linalg.solve(coupled, np.diag(drag))).real))


def place_on(piece: Piece) -> Place:
    """Where a kernel finds itself on a piece of a speed profile."""
    return Place(piece.segment, reduced(piece.start_angle)[0])

"""From a scene to the system that a kernel runs, its start, and its fastest decay rate."""

import math

import numpy as np

from ab_sim.dynamics.ledger import Ledger, ledger_states
from ab_sim.dynamics.motion import Ball, BallMotion, Body, Deck
from ab_sim.dynamics.planar import (
    System,
    ball_force,
    ball_inertia,
    deck_force,
    friction_coefficient,
)
from ab_sim.scene.model import Scene

_DECK_STATES = ("u1", "u2", "v1", "v2")


def system_of(scene: Scene, ledger: bool = False) -> System:
    """The system of a scene: constants, and exactly the effects that the scene names.

    Args:
        scene: a checked scene.
        ledger: whether motor work and losses are integrated along with the motion.
    """
    balls = scene.balls
    masses = np.full(balls.count, balls.mass or 0.0)
    radii = np.full(balls.count, math.nan if balls.radius is None else balls.radius)
    eccentricity = scene.rotor.eccentricity
    body = Body(
        total_mass=scene.total_mass,
        unbalance=scene.eccentric_mass * eccentricity,
        eccentricity=eccentricity,
        race_radius=scene.race.radius,
    )
    effects = tuple(scene.effects.values())
    return System(body, masses, radii, effects, (Ledger(),) if ledger else ())


def start_state(scene: Scene, system: System) -> np.ndarray:
    """The state at t = 0: deck at rest, balls at rest on the race at the scene's angles.

    At rest in space, the deck's velocity on the rotating axes is zero at any speed.
    """
    n = system.ball_masses.size
    state = np.zeros(4 + 2 * n + ledger_states(system.ledger))
    state[4 : 4 + n] = scene.ball_angles
    return state


def state_names(system: System) -> list[str]:
    """A name for each entry of the state, for messages."""
    n = system.ball_masses.size
    names = [*_DECK_STATES]
    names += [f"ball_{i} angle" for i in range(n)] + [f"ball_{i} rate" for i in range(n)]
    return names + ["motor work", "energy dissipated"][: ledger_states(system.ledger)]


def state_bounds(system: System, step: float) -> np.ndarray:
    """Magnitudes that no sound run reaches; beyond them the state is nonsense.

    A deck that has gone a thousand kilometres, or a ball that turns 3 rad along the race within
    one step, which no stepper can follow. Angles and energies grow without limit in sound runs.
    """
    n = system.ball_masses.size
    bounds = np.full(4 + 2 * n + ledger_states(system.ledger), 1e150)
    bounds[:4] = 1e6
    bounds[4 + n : 4 + 2 * n] = 3.0 / step
    return bounds


def linear_rates(system: System, top_speed: float) -> dict[str, complex]:
    """The fastest eigenvalues [1/s] of the linear parts, by what they belong to.

    Args:
        system: the System.
        top_speed: fastest spindle speed [rad/s]: in its frame, the deck's whirl turns that much
            faster.
    """
    body, rest = system.body, Deck(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    mass = body.total_mass - float(system.ball_masses.sum())
    stiffness = -deck_force(system.effects, body, rest._replace(u1=1.0))[0]
    damping = -deck_force(system.effects, body, rest._replace(v1=1.0))[0]
    poles = np.roots([mass, damping, stiffness])
    turning = [pole + 1j * (top_speed if pole.imag >= 0 else -top_speed) for pole in poles]
    return {
        "the race's drag": complex(-drag_rate(system)),
        "the deck's whirl at spindle.max_speed": complex(max(turning, key=abs)),
    }


def friction_kick(system: System, speed: float) -> float:
    """How fast friction slows a ball at a spindle speed [rad/s], deck at rest [rad/s^2]."""
    kicks = [
        friction_coefficient(system.effects, ball)
        * ball.mass
        * speed**2
        / (ball.mass + ball_inertia(system.effects, ball))
        for ball in map(Ball, system.ball_masses, system.ball_radii)
    ]
    return float(max(kicks, default=0.0))


def drag_rate(system: System) -> float:
    """Fastest decay rate [1/s] of a ball's speed along the race under the effects' drag.

    c_b/(m + I/a^2) for a ball on a fixed deck. A deck that is free to move lightens the balls;
    they are lightest side by side, so that is assumed: the largest eigenvalue of G^-1 c_b with
    G_ij = mu_i delta_ij - m_i m_j / M (EQUATIONS.md section 1, A eliminated).
    """
    n = system.ball_masses.size
    if n == 0:
        return 0.0
    body, masses = system.body, system.ball_masses
    rest = Deck(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    balls = [Ball(m, a) for m, a in zip(masses, system.ball_radii, strict=True)]

    def force(ball: Ball, rate: float) -> float:
        return float(ball_force(system.effects, body, ball, BallMotion(1.0, 0.0, rate, rate), rest))

    drag = np.array([(force(b, 0.0) - force(b, 1.0)) / body.race_radius for b in balls])
    inertia = np.array([b.mass + ball_inertia(system.effects, b) for b in balls])
    coupled = np.diag(inertia) - np.outer(masses, masses) / body.total_mass
    return float(np.max(np.linalg.eigvals(np.linalg.solve(coupled, np.diag(drag))).real))

"""A deck that moves in the plane of the disc: docs/equations.md, 1.

State: u1, u2, displacement from the position at rest, on axes that turn with the rotor; axis 1
points at the unbalance. v1, v2, inertial velocity on the same axes. (The deformation of springs, in
contrast, counts from their free length.)

x = (A1, A2, al), A the deck's *specific force* on these axes, its acceleration less gravity. With
J = [[0, -1], [1, 0]]

    u' = v - w J u                  v' = A + gravity - w J v
    M A = f + M0 e (w^2, -al) + sum_i m [ (h w^2 + 2 w s' + l theta_i'^2 + x al) n_i
                                          + (x w^2 - h al - g) t_i ]
    mu g = F - nu_i N - m A.t_i - (h m - (I/a^2) a) al + m x w^2,    mu = m + I/a^2
    N = m (h w^2 + 2 w s' + l theta_i'^2 + x al - A.n_i)
    (I_r + M0 e^2) al + M0 e A2 + sum_i [ (m r x ball's specific force)_i + (I/a) (a al - g) ] = T

with f the suspension's force, F the effects' force along the race, N the race's normal force, and
nu_i the coefficient of friction, signed as theta_i'. Sources: thesis (2-9) to (2-14); three-ball
(5) to (9); relative-stability (7) to (10).
"""

from collections.abc import Sequence
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from ab_sim.model.equations.arrowhead import Arrow
from ab_sim.model.equations.deck_model import deck_model
from ab_sim.model.equations.motion import (
    BallConstants,
    DeckMotion,
    OnRace,
    SpindleMotion,
    drag_force,
    on_race,
    relative_load,
)
from ab_sim.model.equations.sums import Number, any_has, over_balls, over_effects

State = Sequence[Number]
"""State: u1, u2, v1, v2."""


@deck_model(
    UNKNOWNS=2,
    STATE_NAMES=("u1", "u2", "v1", "v2"),
    NEEDS_ANGLE=False,
    AXES=2,
    CHANNELS=("x", "y", "vx", "vy", "ax", "ay"),
)
class Planar(NamedTuple):
    """Constants of deck and rotor, and the deck's equations."""

    total_mass: Number
    """Total mass M [kg], balls included."""
    unbalance: Number
    """Unbalance M0 e [kg m]."""
    eccentricity: Number
    """Eccentricity e [m]."""
    sag_x: Number
    sag_y: Number
    """Position at rest from the unloaded suspension, on axes fixed in space [m]."""

    def arrow(
        self, effects: Any, balls: BallConstants, on: OnRace, spindle: SpindleMotion, state: State
    ) -> Arrow:
        """Return the equations of motion: a block for deck and spindle, and a line per ball."""
        n, w, m, c, s = balls.number, spindle.speed, balls.mass, on.c, on.s
        f1, f2 = self.free_force(effects, spindle, state)
        moment_1, moment_2 = self.ball_moment(on)
        load, along = relative_load(effects, balls, on, w)
        spin_mass = over_effects(effects, "ball_inertia", 0.0, balls.each)
        # Inertia about the shaft, with the balls fixed to the race.
        inertia = on.mh * on.h + on.mx * on.x
        if any_has(effects, "ball_inertia"):
            inertia = inertia + spin_mass * balls.radius * balls.radius
        rotor = over_effects(effects, "rotor_moment", 0.0) + self.unbalance * self.eccentricity
        b13 = over_balls(n, -moment_2)
        b23 = self.unbalance + over_balls(n, moment_1)
        M = self.total_mass
        return Arrow(
            block=[[M, 0.0, b13], [0.0, M, b23], [b13, b23, rotor + over_balls(n, inertia)]],
            force=[
                f1 + over_balls(n, load * c - along * s),
                f2 + over_balls(n, load * s + along * c),
                spindle.torque - over_balls(n, on.mx * (2.0 * w + on.rate) * on.path),
            ],
            coupling=[m * s, -(m * c), -on.lever],
            normal_coupling=[-(m * c), -(m * s), on.mx],
            load=load,
            path_force=along + drag_force(effects, balls, on),
        )

    def free_force(self, effects: Any, spindle: SpindleMotion, state: State) -> list[Number]:
        """Return the force on the deck without the balls' reaction, on the rotor's axes [N]."""
        f1, f2 = _suspension_force(self, effects, spindle, state)
        return [f1 + self.unbalance * (spindle.speed * spindle.speed), f2]

    def ball_moment(self, on: OnRace) -> list[Number]:
        """Return mass times position from the shaft, of each ball, on the rotor's axes [kg m]."""
        return [on.mh * on.c - on.mx * on.s, on.mh * on.s + on.mx * on.c]

    def rates(
        self, effects: Any, spindle: SpindleMotion, state: State, x: Sequence[Number]
    ) -> list[Number]:
        """Return the rates of change of the deck's states, from the accelerations x."""
        u1, u2, v1, v2 = state
        w = spindle.speed
        g1, g2 = _gravity_on_rotating_axes(effects, spindle)
        return [v1 + w * u2, v2 - w * u1, x[0] + g1 + w * v2, x[1] + g2 - w * v1]

    def channels(
        self, effects: Any, spindle: SpindleMotion, state: State, x: Sequence[Number]
    ) -> list[Number]:
        """Return x, y, vx, vy, ax, ay: displacement, velocity and acceleration on fixed axes.

        Parameters
        ----------
        effects
            Effects of the scene.
        spindle
            Motion of the spindle, cosine and sine of its angle included.
        state
            The state.
        x
            The accelerations.
        """
        g1, g2 = _gravity_on_rotating_axes(effects, spindle)
        pairs = (state[0], state[1]), (state[2], state[3]), (x[0] + g1, x[1] + g2)
        return [number for pair in pairs for number in on_fixed_axes(spindle, *pair)]

    def dissipated(self, effects: Any, spindle: SpindleMotion, state: State) -> Number:
        """Return the power that the suspension dissipates [W]."""
        u1, u2, v1, v2 = state
        vx, vy = on_fixed_axes(spindle, v1, v2) if any_has(effects, "space_loss") else (0.0, 0.0)
        loss = over_effects(effects, "deck_loss", 0.0, DeckMotion(u1, u2, v1, v2))
        return loss + over_effects(effects, "space_loss", 0.0, DeckMotion(0.0, 0.0, vx, vy))

    def jump(self, state: State, jumps: Sequence[Number]) -> list[Number]:
        """Return the change of the state at an impact.

        Parameters
        ----------
        state
            State before the impact.
        jumps
            Jumps of the deck's velocity [m/s] on rotating axes, in the order of x.
        """
        return [0.0, 0.0, jumps[0], jumps[1]]

    def place(self, states: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Return the displacement on fixed axes [m], shape (samples, 2)."""
        c, s, (u1, u2) = np.cos(psi), np.sin(psi), states.T[:2]
        return np.stack([c * u1 - s * u2, s * u1 + c * u2], axis=1)

    def specific_force(
        self, effects: Any, channels: Sequence[Number], point: Sequence[float]
    ) -> list[Number]:
        """Return the specific force on fixed axes [m/s^2].

        It is the same at all points, because the deck does not turn.
        """
        gravity = over_effects(effects, "gravity", (0.0, 0.0))
        return [channels[4] - gravity[0], channels[5] - gravity[1]]

    def at_rest(self, states: np.ndarray) -> np.ndarray:
        """Return the channels of a deck at rest, at a spindle angle of 0; shape (1, 6)."""
        return np.array([[*states[:2], 0.0, 0.0, 0.0, 0.0]])

    def scale(self, length: float, speed: float) -> list[float]:
        """Return magnitudes of the states, from a length [m] and a spindle speed [rad/s]."""
        return [length, length, length * speed, length * speed]

    def tangent(self, states: np.ndarray) -> np.ndarray:
        """Return directions of all changes of the state, one per column, shape (4, 4)."""
        return np.eye(4)

    def energy(
        self, effects: Any, balls: BallConstants, state: np.ndarray, psi: float, speed: float
    ) -> float:
        """Return kinetic and stored energy [J]; the energy of gravity is 0 without a sag.

        Parameters
        ----------
        effects
            Effects of the scene.
        balls
            Constants of the balls.
        state
            State of the system.
        psi
            Spindle angle [rad].
        speed
            Spindle speed [rad/s].
        """
        w, e, n, spindle = (
            speed,
            self.eccentricity,
            balls.number,
            SpindleMotion(speed, 0.0, cos(psi), sin(psi), 0.0, 0.0),
        )
        u1, u2, v1, v2 = (float(x) for x in state[:4])
        sag_1, sag_2 = _on_rotating_axes(spindle, self.sag_x, self.sag_y)
        u1, u2 = u1 + sag_1, u2 + sag_2
        g1, g2 = _gravity_on_rotating_axes(effects, spindle)
        rest = self.total_mass - float(np.sum(balls.mass))
        energy = 0.5 * rest * (v1**2 + v2**2)
        energy += 0.5 * over_effects(effects, "rotor_moment", 0.0) * w * w
        energy += self.unbalance * w * (v2 + 0.5 * e * w)
        energy -= self.total_mass * (g1 * u1 + g2 * u2) + self.unbalance * g1
        energy += over_effects(effects, "deck_energy", 0.0, DeckMotion(u1, u2, v1, v2))
        fixed = DeckMotion(*on_fixed_axes(spindle, u1, u2), 0.0, 0.0)
        energy += over_effects(effects, "space_energy", 0.0, fixed)
        theta, rate = state[4 : 4 + n], state[4 + n : 4 + 2 * n]
        on = on_race(effects, balls, np.cos(theta), np.sin(theta), rate)
        along, outwards = on.h * w + on.path, -on.x * w
        b1, b2 = v1 - along * on.s + outwards * on.c, v2 + along * on.c + outwards * on.s
        moving = 0.5 * balls.mass * (b1 * b1 + b2 * b2)
        down = g1 * (on.h * on.c - on.x * on.s) + g2 * (on.h * on.s + on.x * on.c)
        moving = moving - balls.mass * down
        if any_has(effects, "ball_inertia"):
            surface_speed = balls.radius * w - on.path
            inertia = over_effects(effects, "ball_inertia", 0.0, balls.each)
            moving = moving + 0.5 * inertia * surface_speed * surface_speed
        return float(energy + np.sum(moving))


def on_fixed_axes(spindle: SpindleMotion, one: Number, two: Number) -> tuple[Number, Number]:
    """Return a vector on fixed axes, from its components on the rotor's axes."""
    c, s = spindle.cos, spindle.sin
    return c * one - s * two, s * one + c * two


def _on_rotating_axes(spindle: SpindleMotion, one: Number, two: Number) -> tuple[Number, Number]:
    """Return a vector on the rotor's axes, from its components on fixed axes."""
    c, s = spindle.cos, spindle.sin
    return c * one + s * two, c * two - s * one


def _gravity_on_rotating_axes(effects: Any, spindle: SpindleMotion) -> tuple[Number, Number]:
    """Return gravity across the shaft on rotating axes [m/s^2]."""
    if not any_has(effects, "gravity"):
        return 0.0, 0.0
    return _on_rotating_axes(spindle, *over_effects(effects, "gravity", (0.0, 0.0)))


def _suspension_force(
    deck: Any, effects: Any, spindle: SpindleMotion, state: State
) -> tuple[Number, Number]:
    """Return the force of the suspension on the deck, on the rotor's axes [N]."""
    u1, u2, v1, v2 = state
    if any_has(effects, "gravity"):
        # The state counts from the position at rest, the springs from their free length.
        sag_1, sag_2 = _on_rotating_axes(spindle, deck.sag_x, deck.sag_y)
        u1, u2 = u1 + sag_1, u2 + sag_2
    f1, f2 = over_effects(effects, "deck_force", (0.0, 0.0), DeckMotion(u1, u2, v1, v2))
    if any_has(effects, "space_force"):
        fixed = DeckMotion(*on_fixed_axes(spindle, u1, u2), *on_fixed_axes(spindle, v1, v2))
        across = _on_rotating_axes(
            spindle, *over_effects(effects, "space_force", (0.0, 0.0), fixed)
        )
        f1, f2 = f1 + across[0], f2 + across[1]
    return f1, f2

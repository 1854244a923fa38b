"""A deck that moves in the plane of the disc: docs/equations.md, 1, for any number of balls.

States: u1, u2, v1, v2, displacement and inertial velocity on axes that turn with the rotor, axis 1
of which points at the unbalance.

A is the deck's *specific force* on the rotating axes: its acceleration less gravity, what an
accelerometer on it reads. The race is given by its outward normal n_i = (cos theta_i, sin theta_i)
and tangent t_i at ball i, the ball's centre lies at h n_i + x t_i from the shaft, l is the race's
radius of curvature there, s' = l theta_i' and g = s'' are path speed and acceleration. Newton, and
the balls' spins, then say (a round race on the shaft axis has h = l = R and x = 0)

    u' = v - w J u                  v' = A + gravity - w J v
    M A = f + M0 e (w^2, -al) + sum_i m [ (h w^2 + 2 w s' + l theta_i'^2 + x al) n_i
                                          + (x w^2 - h al - g) t_i ]
    mu g = F - f_i N - m A.t_i - (h m - (I/a^2) a) al + m x w^2,    mu = m + I/a^2
    N = m (h w^2 + 2 w s' + l theta_i'^2 + x al - A.n_i)

with f the suspension's force, F the effects' force along the race, N the race's normal force, and
f_i the coefficient of friction, signed as theta_i'. With a motor al is unknown as well and

    (I_r + M0 e^2) al + M0 e A2 + sum_i [ (m r x ball's specific force)_i + (I/a) (a al - g) ] = T.
"""

from math import cos, sin
from typing import Any, NamedTuple

import numpy as np
from numba.extending import register_jitable

from ab_sim.dynamics.carriers.facts import carrier
from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.layout import angle_at, rate_at
from ab_sim.dynamics.motion import Deck
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.race.ball import (
    ball_of,
    moment_from_shaft,
    place_from_shaft,
    relative_load,
    spindle_lever,
)
from ab_sim.dynamics.race.elimination import solve_with_balls
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.race.table import COS, LOAD, PATH, PATH_ACCELERATION, REACH, SIN
from ab_sim.dynamics.system import (
    MASS,
    RACE_RADIUS,
    ball_count,
    ball_inertia,
    deck_energy,
    deck_force,
    deck_loss,
    gravity,
    has_friction,
    has_gravity,
    has_motor,
    has_runout,
    has_space_force,
    has_spin,
    race_shape,
    rotor_moment,
    space_energy,
    space_force,
    space_loss,
)

_K = 3


@carrier(
    STATES=4,
    UNKNOWNS=2,
    STATE_NAMES=("u1", "u2", "v1", "v2"),
    NEEDS_ANGLE=False,
    WAYS=2,
    COORDINATES=2,
    CHANNELS=("x", "y", "vx", "vy", "ax", "ay"),
)
class Planar(NamedTuple):
    """Constants of deck and rotor."""

    total_mass: float
    """M [kg], balls included."""
    unbalance: float
    """M0 e [kg m]."""
    eccentricity: float
    """e [m]."""
    sag_x: float
    sag_y: float
    """[m], where the deck hangs at rest, from the unloaded suspension, on axes fixed in space."""

    def begin(self, plant: Any, spindle: Any, state: Any) -> Any:
        """See ``carriers``; no frame is needed."""
        system, block, w = plant.system, plant.room.block, spindle.speed
        f1, f2 = suspension_force(plant, spindle, state)
        block[0, 0] = block[1, 1] = self.total_mass
        block[0, 1] = block[0, 2] = 0.0
        block[1, 2] = self.unbalance
        block[2, 2] = rotor_moment(system.effects) + self.unbalance * self.eccentricity
        block[0, _K] = f1 + self.unbalance * (w * w)
        block[1, _K] = f2
        block[2, _K] = spindle.torque
        return 0.0

    def bear(self, plant: Any, spindle: Any, frame: Any, c: Any, s: Any, i: int, state: Any) -> Any:
        """See ``carriers``."""
        system, table, block = plant.system, plant.room.table, plant.room.block
        m, rate = system.balls[i, MASS], state[rate_at(system, i)]
        load, along = relative_load(plant, spindle.speed, rate, i)
        mh, mx = moment_from_shaft(plant, i)
        # m J r, with r the ball's place from the shaft.
        r1, r2 = -(mh * s), mh * c
        table[i, COS] = c
        table[i, SIN] = s
        table[i, LOAD] = load
        table[i, REACH] = m * s
        table[i, REACH + 1] = -(m * c)
        table[i, REACH + 2] = -spindle_lever(plant, i)
        block[0, _K] += load * c
        block[1, _K] += load * s
        h, x = place_from_shaft(plant, i)
        inertia = mh * h
        if has_runout(system.effects):
            r1 -= mx * c
            r2 -= mx * s
            inertia += mx * x
            block[0, _K] -= along * s
            block[1, _K] += along * c
            block[2, _K] -= mx * (2.0 * spindle.speed + rate) * table[i, PATH]
        if has_friction(system.effects):
            table[i, REACH + _K] = -(m * c)
            table[i, REACH + _K + 1] = -(m * s)
            table[i, REACH + _K + 2] = mx
        block[0, 2] += r1
        block[1, 2] += r2
        block[2, 2] += inertia
        if has_spin(system.effects):
            ball = ball_of(system, i)
            block[2, 2] += ball_inertia(system.effects, ball) * ball.radius * ball.radius
        return along

    def move(self, plant: Any, spindle: Any, frame: Any, state: Any, slope: Any) -> None:
        """See ``carriers``."""
        x, w = plant.room.acceleration, spindle.speed
        u1, u2, v1, v2 = state[0], state[1], state[2], state[3]
        slope[0] = v1 + w * u2
        slope[1] = v2 - w * u1
        slope[2] = x[0] + w * v2
        slope[3] = x[1] - w * v1
        if has_gravity(plant.system.effects):
            g1, g2 = gravity_on_rotating_axes(plant, spindle)
            slope[2] += g1
            slope[3] += g2

    def to_coordinates(self, own: Any, state: Any, x: Any, v: Any) -> None:
        """See ``carriers``."""
        x[0], x[1], v[0], v[1] = state[0], state[1], state[2], state[3]

    def from_coordinates(self, own: Any, axes: Any, x: Any, v: Any, state: Any) -> None:
        """See ``carriers``."""
        c, s = axes
        state[0], state[1] = c * x[0] + s * x[1], c * x[1] - s * x[0]
        state[2], state[3] = c * v[0] + s * v[1], c * v[1] - s * v[0]

    def give_way(self, plant: Any) -> None:
        """See ``carriers``."""
        system, room = plant.system, plant.room
        if has_motor(system.effects):
            solve_with_balls(race_of(plant))
            return
        x, lightness = room.acceleration, 1.0 / self.total_mass
        for r in range(2):
            force = room.block[r, _K] - room.block[r, 2] * x[2]
            for i in range(ball_count(system)):
                path = room.table[i, PATH_ACCELERATION]
                force = multiply_add(room.table[i, REACH + r], path, force)
            x[r] = force * lightness

    def coordinate_accelerations(
        self, plant: Any, spindle: Any, own: Any, axes: Any, state: Any, out: Any
    ) -> None:
        """See ``carriers``."""
        c, s = axes
        g1, g2 = gravity_on_rotating_axes(plant, spindle)
        one, two = plant.room.acceleration[0] + g1, plant.room.acceleration[1] + g2
        out[0], out[1] = c * one - s * two, s * one + c * two

    def accelerate(self, plant: Any, own: Any, axes: Any, state: Any, change: Any) -> None:
        """See ``carriers``."""
        c, s = axes
        plant.room.acceleration[0] += c * change[0] + s * change[1]
        plant.room.acceleration[1] += c * change[1] - s * change[0]

    def on_next_axes(self, c: Any, s: Any, force: Any) -> None:
        """See ``carriers``."""
        one, two = force[0], force[1]
        force[0], force[1] = c * one + s * two, c * two - s * one

    def show(
        self, plant: Any, spindle: Any, c: Any, s: Any, state: Any, acceleration: Any, shown: Any
    ) -> None:
        """Displacement, velocity and acceleration on inertial axes."""
        g1, g2 = gravity_on_rotating_axes(plant, spindle)
        shown[0], shown[1] = on_inertial_axes(c, s, state[0], state[1])
        shown[2], shown[3] = on_inertial_axes(c, s, state[2], state[3])
        shown[4], shown[5] = on_inertial_axes(c, s, acceleration[0] + g1, acceleration[1] + g2)

    def dissipate(self, plant: Any, spindle: Any, state: Any) -> Any:
        """See ``carriers``."""
        effects = plant.system.effects
        c, s, v1, v2 = spindle.cos, spindle.sin, state[2], state[3]
        loss = deck_loss(effects, Deck(state[0], state[1], v1, v2))
        return loss + space_loss(effects, Deck(0.0, 0.0, c * v1 - s * v2, s * v1 + c * v2))

    def kick(self, state: Any, jumps: Any, velocities: Any) -> None:
        """See ``carriers``."""
        velocities[2] += jumps[0]
        velocities[3] += jumps[1]

    def straighten(self, state: Any) -> bool:
        """Nothing drifts."""
        return False

    def place(self, states: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Displacement on inertial axes [m], shape (samples, 2)."""
        return np.stack(on_inertial_axes(np.cos(psi), np.sin(psi), *states.T[:2]), axis=1)

    def felt(self, system: Any, shown: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Specific force on inertial axes [m/s^2]: the same all over a deck that never turns."""
        own: np.ndarray = shown[:, 4:] - np.array(gravity(system.effects))
        return own

    def at_rest(self, states: np.ndarray) -> np.ndarray:
        """At a spindle angle of 0."""
        return np.array([[*states[:2], 0.0, 0.0, 0.0, 0.0]])

    def scale(self, length: float, speed: float) -> list[float]:
        """Magnitudes of the states, for errors to be measured by; in Python only."""
        return [length, length, length * speed, length * speed]

    def tangent(self, states: np.ndarray) -> np.ndarray:
        """All directions, shape (4, 4); in Python only."""
        return np.eye(4)

    def energy(self, system: Any, state: Any, psi: float, speed: float) -> float:
        """Kinetic and stored energy [J]; in Python only."""
        effects, w, e = system.effects, speed, self.eccentricity
        c, s = cos(psi), sin(psi)
        deck = Deck(*(float(state[j]) for j in range(4)))
        u1, u2 = deck.x + c * self.sag_x + s * self.sag_y, deck.y + c * self.sag_y - s * self.sag_x
        g1, g2 = 0.0, 0.0
        if has_gravity(effects):
            gx, gy = gravity(effects)
            g1, g2 = c * gx + s * gy, c * gy - s * gx
        rest = self.total_mass - float(system.balls[:, MASS].sum())
        energy = 0.5 * rest * (deck.vx**2 + deck.vy**2) + 0.5 * rotor_moment(effects) * w * w
        energy += self.unbalance * w * (deck.vy + 0.5 * e * w)
        energy -= self.total_mass * (g1 * u1 + g2 * u2) + self.unbalance * g1
        energy += deck_energy(effects, deck._replace(x=u1, y=u2))
        energy += space_energy(effects, Deck(c * u1 - s * u2, s * u1 + c * u2, 0.0, 0.0))
        for i in range(ball_count(system)):
            ball, R = ball_of(system, i), system.balls[i, RACE_RADIUS]
            theta, rate = state[angle_at(system, i)], state[rate_at(system, i)]
            nc, ns = cos(theta), sin(theta)
            beyond, x, curve, _ = race_shape(effects, nc, ns)
            h, path = R + beyond, (R + curve) * rate
            along, outwards = h * w + path, -x * w
            v1, v2 = deck.vx - along * ns + outwards * nc, deck.vy + along * nc + outwards * ns
            energy += 0.5 * ball.mass * (v1 * v1 + v2 * v2)
            energy -= ball.mass * (g1 * (h * nc - x * ns) + g2 * (h * ns + x * nc))
            if has_spin(effects):
                spin = ball.radius * w - path
                energy += 0.5 * ball_inertia(effects, ball) * spin * spin
        return float(energy)


@register_jitable(**INLINED)
def on_inertial_axes(c: Any, s: Any, one: Any, two: Any) -> Any:
    """A vector on the rotating axes, (c, s) being cosine and sine of their angle."""
    # Fused by hand, so that a sample has the same digits wherever it is made.
    return multiply_add(c, one, -(s * two)), multiply_add(s, one, c * two)


@register_jitable(**INLINED)
def gravity_on_rotating_axes(plant: Any, spindle: Any) -> Any:
    """Gravity across the shaft [m/s^2], (0, 0) without the effect."""
    if has_gravity(plant.system.effects):
        gx, gy = gravity(plant.system.effects)
        c, s = spindle.cos, spindle.sin
        return c * gx + s * gy, c * gy - s * gx
    return 0.0, 0.0


@register_jitable(**INLINED)
def suspension_force(plant: Any, spindle: Any, state: Any) -> Any:
    """Force of the suspension on the deck, on the rotating axes [N]."""
    carrier, effects = plant.system.carrier, plant.system.effects
    u1, u2, v1, v2 = state[0], state[1], state[2], state[3]
    c, s = spindle.cos, spindle.sin
    if has_gravity(effects):
        # The state counts from where the deck hangs at rest, the springs from their free length.
        u1 += c * carrier.sag_x + s * carrier.sag_y
        u2 += c * carrier.sag_y - s * carrier.sag_x
    f1, f2 = deck_force(effects, Deck(u1, u2, v1, v2))
    if has_space_force(effects):
        fixed = Deck(c * u1 - s * u2, s * u1 + c * u2, c * v1 - s * v2, s * v1 + c * v2)
        fx, fy = space_force(effects, fixed)
        f1 += c * fx + s * fy
        f2 += c * fy - s * fx
    return f1, f2

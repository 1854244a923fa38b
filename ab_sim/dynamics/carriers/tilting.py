"""A deck that moves and tilts in space on its mounts: docs/equations.md, 4.

Conventions of Kim and Chung (2002), made precise: C is the point of the deck on the spindle axis at
height 0; deck axes x, y, z at C are parallel to the ground's while the mounts are relaxed, z is the
spindle axis; the spindle turns by psi relative to the deck, and the unbalance lies in the direction
psi from x. The ground's axes begin where C lies then.

States: X, Y, Z of C on the ground's axes; the quaternion (w, x, y, z) that turns deck axes to the
ground's; the velocity of C on the ground's axes; the deck's angular velocity Om on deck axes.

Newton and Euler about C, on deck axes. A is the specific force at C, its acceleration less gravity;
S the first moment and J the inertia about C of deck, rotor and balls; S_r and P = sum m r r^T those
of the rotor, which turns with psi; w = psi', al = psi''; V = z x S_r. With forces f of the mounts
and their moment t, and balls held on the race,

    M A + Om' x S + al V = f - Om x (Om x S) - 2 w Om x V - w^2 z x V + balls
    S x A + J Om' + al J_r z = t - Om x J Om + 2 w z x P Om - w^2 (P z) x z + balls
    V.A + (J_r z).Om' + al z.J_r z = T - Om.(z x P Om) + balls

A ball at r = h n + x t + Z z, n and t the race's normal and tangent on deck axes, moves relative to
the deck with v = w z x r + s' t, and has the specific force

    a = A + Om' x r + al z x r + g t + b,
    b = Om x (Om x r) + 2 Om x v - (h w^2 + 2 w s' + l theta'^2) n - x w^2 t

which the deck feels as -m a, in the direction and at the place where it acts; along the race it is
the ball's own equation. A ball that rolls spins with w - s'/a about z, carried by the deck's tilt:
its angular momentum is (I/a^2) a^2 (Om + (w - s'/a) z).
"""

from math import cos, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from ab_sim.dynamics.carriers.facts import carrier
from ab_sim.dynamics.carriers.moments import add_point_mass, symmetric, turned_second_moments
from ab_sim.dynamics.carriers.mounts import DAMPING, STIFFNESS, at_mount, mount_forces
from ab_sim.dynamics.carriers.orientation import (
    half_product,
    quaternion_of,
    to_deck,
    to_ground,
    turn_of,
    turning_of,
)
from ab_sim.dynamics.carriers.own_motion import into_modes, out_of_modes
from ab_sim.dynamics.layout import angle_at, rate_at
from ab_sim.dynamics.race.ball import ball_of, place_from_shaft, relative_load
from ab_sim.dynamics.race.elimination import solve_with_balls
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.race.table import COS, LOAD, PATH, REACH, SIN
from ab_sim.dynamics.system import (
    MASS,
    RACE_HEIGHT,
    RACE_RADIUS,
    ball_count,
    ball_inertia,
    has_friction,
    has_spin,
    mount_energy,
    race_shape,
)

_K = 7
DRIFT = 1e-12
"""How far from 1 the quaternion's square may drift before it is made a unit one again. Nothing
depends on its length but its own digits."""


@carrier(
    STATES=13,
    UNKNOWNS=6,
    STATE_NAMES=(
        *("X", "Y", "Z", "quaternion w", "quaternion x", "quaternion y", "quaternion z"),
        *("X rate", "Y rate", "Z rate", "tilt rate x", "tilt rate y", "tilt rate z"),
    ),
    NEEDS_ANGLE=True,
    WAYS=3,
    COORDINATES=7,
    CHANNELS=(
        *("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az"),
        *("qw", "qx", "qy", "qz", "wx", "wy", "wz", "wx_rate", "wy_rate", "wz_rate"),
    ),
)
class Tilting(NamedTuple):
    """Constants of deck, rotor and mounts."""

    total_mass: float
    """M [kg], balls included."""
    unbalance: float
    """M0 e [kg m]."""
    eccentricity: float
    """e [m]."""
    rotor_lift: float
    """M0 times the height of its mass centre [kg m]."""
    deck_first: tuple[float, float, float]
    """First moment of the deck without rotor and balls, on deck axes [kg m]."""
    deck_inertia: tuple[float, float, float, float, float, float]
    """Its inertia about C: xx, yy, zz, xy, xz, yz [kg m^2]; xy is minus the integral of x y dm."""
    rotor_second: tuple[float, float, float, float, float, float]
    """Second moments P of the rotor about C on its own axes, the first through the unbalance: the
    integrals of x^2, y^2, z^2, x y, x z, y z [kg m^2]."""
    mounts: Any
    """Shape (mounts, MOUNT_WIDTH), columns as in mounts.py."""
    gravity: tuple[float, float, float]
    """On the ground's axes [m/s^2]."""

    def begin(self, plant: Any, spindle: Any, state: Any) -> Any:
        """See ``carriers``; the frame is the turn to the ground's axes, row by row, and Om."""
        block, w, c, s = plant.room.block, spindle.speed, spindle.cos, spindle.sin
        frame = turn_of(state)
        ox, oy, oz = state[10], state[11], state[12]
        fx, fy, fz, tx, ty, tz = mount_forces(self, plant.system, frame, state)
        # The rotor as it lies now.
        rx, ry = self.unbalance * c, self.unbalance * s
        pxx, pyy, pzz, pxy, pxz, pyz = turned_second_moments(self.rotor_second, c, s)
        sx, sy = self.deck_first[0] + rx, self.deck_first[1] + ry
        sz = self.deck_first[2] + self.rotor_lift
        jxx, jyy, jzz, jxy, jxz, jyz = self.deck_inertia
        jxx += pyy + pzz
        jyy += pxx + pzz
        jzz += pxx + pyy
        jxy -= pxy
        jxz -= pxz
        jyz -= pyz
        for r in range(_K):
            for q in range(r, _K):
                block[r, q] = 0.0
        block[0, 0] = block[1, 1] = block[2, 2] = self.total_mass
        block[0, 4], block[0, 5] = sz, -sy
        block[1, 3], block[1, 5] = -sz, sx
        block[2, 3], block[2, 4] = sy, -sx
        block[3, 3], block[4, 4], block[5, 5] = jxx, jyy, jzz
        block[3, 4], block[3, 5], block[4, 5] = jxy, jxz, jyz
        block[0, 6], block[1, 6] = -ry, rx
        block[3, 6], block[4, 6], block[5, 6] = -pxz, -pyz, pxx + pyy
        block[6, 6] = pxx + pyy
        # Om x (Om x S) = Om (Om.S) - S Om^2, and 2 w Om x V.
        along, square = ox * sx + oy * sy + oz * sz, ox * ox + oy * oy + oz * oz
        block[0, _K] = fx - (ox * along - sx * square) + 2.0 * w * oz * rx + w * w * rx
        block[1, _K] = fy - (oy * along - sy * square) + 2.0 * w * oz * ry + w * w * ry
        block[2, _K] = fz - (oz * along - sz * square) - 2.0 * w * (ox * rx + oy * ry)
        lx = jxx * ox + jxy * oy + jxz * oz
        ly = jxy * ox + jyy * oy + jyz * oz
        lz = jxz * ox + jyz * oy + jzz * oz
        px = pxx * ox + pxy * oy + pxz * oz
        py = pxy * ox + pyy * oy + pyz * oz
        block[3, _K] = tx - (oy * lz - oz * ly) - 2.0 * w * py - w * w * pyz
        block[4, _K] = ty - (oz * lx - ox * lz) + 2.0 * w * px + w * w * pxz
        block[5, _K] = tz - (ox * ly - oy * lx)
        block[6, _K] = spindle.torque - (oy * px - ox * py)
        return frame

    def bear(self, plant: Any, spindle: Any, frame: Any, c: Any, s: Any, i: int, state: Any) -> Any:
        """See ``carriers``."""
        system, table, block = plant.system, plant.room.table, plant.room.block
        m, z, w = system.balls[i, MASS], system.balls[i, RACE_HEIGHT], spindle.speed
        nx, ny = c * spindle.cos - s * spindle.sin, s * spindle.cos + c * spindle.sin
        h, x = place_from_shaft(plant, i)
        load, along = relative_load(plant, w, state[rate_at(system, i)], i)
        ox, oy, oz = state[10], state[11], state[12]
        on, ot = ox * nx + oy * ny, oy * nx - ox * ny
        vn, vt = -w * x, w * h + table[i, PATH]
        q, square = h * on + x * ot + z * oz, on * on + ot * ot + oz * oz
        load -= m * (on * q - h * square - 2.0 * oz * vt)
        along -= m * (ot * q - x * square + 2.0 * oz * vn)
        lift = -m * (oz * q - z * square + 2.0 * (on * vt - ot * vn))
        table[i, COS] = nx
        table[i, SIN] = ny
        table[i, LOAD] = load
        table[i, REACH] = m * ny
        table[i, REACH + 1] = -(m * nx)
        table[i, REACH + 2] = 0.0
        table[i, REACH + 3] = m * z * nx
        table[i, REACH + 4] = m * z * ny
        table[i, REACH + 5] = -(m * h)
        table[i, REACH + 6] = -(m * h)
        if has_friction(system.effects):
            table[i, REACH + _K] = -(m * nx)
            table[i, REACH + _K + 1] = -(m * ny)
            table[i, REACH + _K + 2] = 0.0
            table[i, REACH + _K + 3] = m * z * ny
            table[i, REACH + _K + 4] = -(m * z * nx)
            table[i, REACH + _K + 5] = m * x
            table[i, REACH + _K + 6] = m * x
        rx, ry = h * nx - x * ny, h * ny + x * nx
        add_point_mass(block, m, rx, ry, z)
        block[0, _K] += load * nx - along * ny
        block[1, _K] += load * ny + along * nx
        block[2, _K] += lift
        tn, tt = x * lift - z * along, z * load - h * lift
        block[3, _K] += tn * nx - tt * ny
        block[4, _K] += tn * ny + tt * nx
        block[5, _K] += h * along - x * load
        block[6, _K] += h * along - x * load
        if has_spin(system.effects):
            ball = ball_of(system, i)
            lever = ball_inertia(system.effects, ball) * ball.radius
            inertia = lever * ball.radius
            turning = inertia * w - lever * table[i, PATH]
            table[i, REACH + 5] += lever
            table[i, REACH + 6] += lever
            block[3, 3] += inertia
            block[4, 4] += inertia
            block[5, 5] += inertia
            block[5, 6] += inertia
            block[6, 6] += inertia
            block[3, _K] -= turning * oy
            block[4, _K] += turning * ox
        return along

    def move(self, plant: Any, spindle: Any, frame: Any, state: Any, slope: Any) -> None:
        """See ``carriers``."""
        x = plant.room.acceleration
        ox, oy, oz = state[10], state[11], state[12]
        slope[0], slope[1], slope[2] = state[7], state[8], state[9]
        slope[3], slope[4], slope[5], slope[6] = half_product(quaternion_of(state), ox, oy, oz)
        ax, ay, az = to_ground(frame, x[0], x[1], x[2])
        slope[7] = ax + self.gravity[0]
        slope[8] = ay + self.gravity[1]
        slope[9] = az + self.gravity[2]
        slope[10], slope[11], slope[12] = x[3], x[4], x[5]

    def to_coordinates(self, own: Any, state: Any, x: Any, v: Any) -> None:
        """See ``carriers``."""
        turn = quaternion_of(state)
        rate = half_product(turn, state[10], state[11], state[12])
        into_modes(own, (state[0], state[1], state[2]), turn, x)
        into_modes(own, (state[7], state[8], state[9]), rate, v)

    def from_coordinates(self, own: Any, axes: Any, x: Any, v: Any, state: Any) -> None:
        """See ``carriers``."""
        place, turn = out_of_modes(own, x)
        velocity, rate = out_of_modes(own, v)
        state[0], state[1], state[2] = place
        state[3], state[4], state[5], state[6] = turn
        state[7], state[8], state[9] = velocity
        state[10], state[11], state[12] = turning_of(turn, rate)

    def only_own_motion(self, effects: Any) -> bool:
        """See ``carriers``: its tilt turns what all forces act along."""
        return False

    def give_way(self, plant: Any) -> None:
        """See ``carriers``."""
        solve_with_balls(race_of(plant))

    def coordinate_accelerations(
        self, plant: Any, spindle: Any, own: Any, axes: Any, state: Any, out: Any
    ) -> None:
        """See ``carriers``."""
        a, turn = plant.room.acceleration, quaternion_of(state)
        x, y, z = to_ground(turn_of(state), a[0], a[1], a[2])
        ox, oy, oz = state[10], state[11], state[12]
        change = half_product(half_product(turn, ox, oy, oz), ox, oy, oz)
        more = half_product(turn, a[3], a[4], a[5])
        change = (
            change[0] + more[0],
            change[1] + more[1],
            change[2] + more[2],
            change[3] + more[3],
        )
        g = self.gravity
        into_modes(own, (x + g[0], y + g[1], z + g[2]), change, out)

    def accelerate(self, plant: Any, own: Any, axes: Any, state: Any, change: Any) -> None:
        """See ``carriers``."""
        a, (place, turn) = plant.room.acceleration, out_of_modes(own, change)
        x, y, z = to_deck(turn_of(state), place[0], place[1], place[2])
        px, py, pz = turning_of(quaternion_of(state), turn)
        a[0] += x
        a[1] += y
        a[2] += z
        a[3] += px
        a[4] += py
        a[5] += pz

    def on_next_axes(self, c: Any, s: Any, force: Any) -> None:
        """See ``carriers``: the axes stand still for ever."""

    def show(
        self, plant: Any, spindle: Any, c: Any, s: Any, state: Any, acceleration: Any, shown: Any
    ) -> None:
        """Place, velocity, acceleration, quaternion, turning and its rate."""
        x, g = acceleration, self.gravity
        ax, ay, az = to_ground(turn_of(state), x[0], x[1], x[2])
        shown[6], shown[7], shown[8] = ax + g[0], ay + g[1], az + g[2]
        square = state[3] * state[3] + state[4] * state[4]
        length = sqrt(square + state[5] * state[5] + state[6] * state[6])
        for j in range(3):
            shown[j], shown[3 + j] = state[j], state[7 + j]
            shown[13 + j], shown[16 + j] = state[10 + j], x[3 + j]
        for j in range(4):
            shown[9 + j] = state[3 + j] / length

    def dissipate(self, plant: Any, spindle: Any, state: Any) -> Any:
        """See ``carriers``."""
        frame, loss = turn_of(state), 0.0
        for k in range(self.mounts.shape[0]):
            _, speed = at_mount(self, frame, state, k)
            for axis in range(3):
                loss += self.mounts[k, DAMPING + axis] * speed[axis] * speed[axis]
        return loss

    def kick(self, state: Any, jumps: Any, velocities: Any) -> None:
        """See ``carriers``."""
        vx, vy, vz = to_ground(turn_of(state), jumps[0], jumps[1], jumps[2])
        velocities[7] += vx
        velocities[8] += vy
        velocities[9] += vz
        velocities[10] += jumps[3]
        velocities[11] += jumps[4]
        velocities[12] += jumps[5]

    def straighten(self, state: Any) -> bool:
        """Make the quaternion a unit one again."""
        square = state[3] ** 2 + state[4] ** 2 + state[5] ** 2 + state[6] ** 2
        if abs(square - 1.0) <= DRIFT:
            return False
        scale = 1.0 / sqrt(square)
        for j in range(3, 7):
            state[j] *= scale
        return True

    def place(self, states: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Of C on the ground's axes [m], shape (samples, 3)."""
        return states[:, :3]

    def felt(self, system: Any, shown: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Specific force at a point of the deck on its axes [m/s^2], shape (samples, 3)."""
        _, _, acceleration, _, rates, change = np.split(shown, [3, 6, 9, 13, 16], axis=1)
        # The quaternion lies behind three others, as in a state.
        turn = np.array(turn_of(shown.T[6:])).reshape(3, 3, -1)
        force = np.einsum("jis,sj->si", turn, acceleration - np.array(self.gravity))
        own: np.ndarray = (
            force + np.cross(change, point) + np.cross(rates, np.cross(rates, point[None, :]))
        )
        return own

    def at_rest(self, states: np.ndarray) -> np.ndarray:
        """Where it is and as it is turned."""
        found = np.zeros((1, 19))
        found[0, :3], found[0, 9:13] = states[:3], states[3:7] / np.linalg.norm(states[3:7])
        return found

    def scale(self, length: float, speed: float) -> list[float]:
        """Magnitudes of the states, for errors to be measured by; in Python only."""
        return [*[length] * 3, *[1.0] * 4, *[length * speed] * 3, *[speed] * 3]

    def tangent(self, states: np.ndarray) -> np.ndarray:
        """All directions but the one along the quaternion, shape (13, 12); in Python only.

        A small turn by phi on deck axes adds q (0, phi) / 2 to the quaternion q.
        """
        w, x, y, z = states[3:7] / np.linalg.norm(states[3:7])
        ways = np.zeros((13, 12))
        ways[:3, :3], ways[7:, 6:] = np.eye(3), np.eye(6)
        ways[3:7, 3:6] = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
        return ways

    def energy(self, system: Any, state: Any, psi: float, speed: float) -> float:
        """Kinetic and stored energy [J], gravity's from where C lies at the origin; in Python."""
        turn = np.array(turn_of(state)).reshape(3, 3)
        velocity, omega = turn.T @ state[7:10], np.array(state[10:13])
        shaft = np.array([0.0, 0.0, 1.0])
        c, s = cos(psi), sin(psi)
        moments = turned_second_moments(self.rotor_second, c, s)
        rotor = np.array([self.unbalance * c, self.unbalance * s, self.rotor_lift])
        spinning = omega + speed * shaft
        balls_mass = float(system.balls[:, MASS].sum())
        energy = 0.5 * (self.total_mass - balls_mass) * float(velocity @ velocity)
        first = np.array(self.deck_first)
        energy += float(velocity @ (np.cross(omega, first) + np.cross(spinning, rotor)))
        energy += 0.5 * float(omega @ symmetric(self.deck_inertia) @ omega)
        own = symmetric(moments)
        energy += 0.5 * float(spinning @ (np.trace(own) * np.eye(3) - own) @ spinning)
        gravity = turn.T @ np.array(self.gravity)
        energy -= float(gravity @ (first + rotor)) + self.total_mass * float(
            np.array(self.gravity) @ state[:3]
        )
        for i in range(ball_count(system)):
            ball = ball_of(system, i)
            R, z = system.balls[i, [RACE_RADIUS, RACE_HEIGHT]]
            theta, rate = state[angle_at(system, i)], state[rate_at(system, i)]
            beyond, x, curve, _ = race_shape(system.effects, cos(theta), sin(theta))
            path = (R + curve) * rate
            normal = np.array([cos(theta + psi), sin(theta + psi), 0.0])
            along = np.cross(shaft, normal)
            place = (R + beyond) * normal + x * along + z * shaft
            moving = velocity + np.cross(spinning, place) + path * along
            energy += 0.5 * ball.mass * float(moving @ moving)
            energy -= ball.mass * float(gravity @ place)
            if has_spin(system.effects):
                spin = ball.radius * (omega + speed * shaft) - path * shaft
                energy += 0.5 * ball_inertia(system.effects, ball) * float(spin @ spin)
        for k in range(len(self.mounts)):
            moved = np.array(at_mount(self, turn.ravel(), state, k)[0])
            energy += 0.5 * float(self.mounts[k, STIFFNESS:DAMPING] @ moved**2)
            energy += mount_energy(system.effects, float(moved @ moved))
        return float(energy)

"""A deck that moves and tilts in space on its mounts: docs/equations.md, 4.

Conventions of Kim and Chung (2002), made precise: C is the point of the deck on the spindle axis at
height 0; deck axes x, y, z at C are parallel to the ground's while the mounts are relaxed, z is the
spindle axis; the spindle turns by psi relative to the deck, and the unbalance lies in the direction
psi from x. The origin of the ground's axes is the position of C with relaxed mounts.

State: X, Y, Z of C on the ground's axes; the quaternion (w, x, y, z) that turns deck axes to the
ground's; the velocity of C on the ground's axes; the deck's angular velocity Om on deck axes.

x = (A, Om', al) on deck axes, A the specific force at C, its acceleration less gravity. S is the
first moment and J the inertia about C of deck, rotor and balls; S_r and P = sum m r r^T those of
the rotor, which turns with psi; w = psi', al = psi''; V = z x S_r. With forces f of the mounts and
their moment t, and the balls as if fixed to the race,

    M A + Om' x S + al V = f - Om x (Om x S) - 2 w Om x V - w^2 z x V + balls
    S x A + J Om' + al J_r z = t - Om x J Om + 2 w z x P Om - w^2 (P z) x z + balls
    V.A + (J_r z).Om' + al z.J_r z = T - Om.(z x P Om) + balls

A ball at r = h n + x t + Z z, n and t the race's normal and tangent on deck axes, moves relative to
the deck with v = w z x r + s' t, and has the specific force

    a = A + Om' x r + al z x r + g t + b,
    b = Om x (Om x r) + 2 Om x v - (h w^2 + 2 w s' + l theta'^2) n - x w^2 t

The force -m a acts on the deck at the ball. The component of a along the race gives the ball's own
equation. A ball that rolls spins with w - s'/a about z, in addition to the deck's rotation: its
angular momentum is (I/a^2) a^2 (Om + (w - s'/a) z).
"""

from collections.abc import Sequence
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.ordered_sum import ordered_dot
from ab_sim.model.equations.arrowhead import Arrow
from ab_sim.model.equations.deck_model import deck_model
from ab_sim.model.equations.motion import (
    BallConstants,
    OnRace,
    SpindleMotion,
    drag_force,
    on_race,
    relative_load,
)
from ab_sim.model.equations.mounts import (
    cross,
    half_product,
    mount_energy,
    mount_forces,
    mount_loss,
    to_deck,
    to_ground,
    turn_of,
)
from ab_sim.model.equations.sums import Number, any_has, over_balls, over_effects
from ab_sim.tracing.functions import sqrt

State = Sequence[Number]
"""State: X, Y, Z; quaternion; velocity; Om; thirteen numbers."""


@deck_model(
    UNKNOWNS=6,
    STATE_NAMES=(
        *("X", "Y", "Z", "quaternion w", "quaternion x", "quaternion y", "quaternion z"),
        *("X rate", "Y rate", "Z rate", "tilt rate x", "tilt rate y", "tilt rate z"),
    ),
    NEEDS_ANGLE=True,
    UNIT_AT=3,
    AXES=3,
    CHANNELS=(
        *("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az"),
        *("qw", "qx", "qy", "qz", "wx", "wy", "wz", "wx_rate", "wy_rate", "wz_rate"),
    ),
)
class InSpace(NamedTuple):
    """Constants of deck, rotor and mounts, and the deck's equations."""

    total_mass: Number
    """Total mass M [kg], balls included."""
    unbalance: Number
    """Unbalance M0 e [kg m]."""
    eccentricity: Number
    """Eccentricity e [m]."""
    rotor_first_z: Number
    """M0 z_c, the rotor's first moment along the shaft [kg m]."""
    deck_first: tuple[Number, Number, Number]
    """First moment of the deck without rotor and balls, on deck axes [kg m]."""
    deck_inertia: tuple[Number, Number, Number, Number, Number, Number]
    """Inertia of the deck without rotor and balls about C: xx, yy, zz, xy, xz, yz [kg m^2], where
    xy is minus the integral of x y dm."""
    rotor_second: tuple[Number, Number, Number, Number, Number, Number]
    """Second moments P of the rotor about C on its own axes, the first through the unbalance: the
    integrals of x^2, y^2, z^2, x y, x z, y z [kg m^2]."""
    mounts: Any
    """Constants of the mounts, shape (mounts, MOUNT_WIDTH), columns as in mounts.py."""
    gravity: tuple[Number, Number, Number]
    """Acceleration of gravity on the ground's axes [m/s^2]."""

    def arrow(
        self, effects: Any, balls: BallConstants, on: OnRace, spindle: SpindleMotion, state: State
    ) -> Arrow:
        """Return the equations of motion: a block for deck and spindle, and a line per ball."""
        block, force = _deck_and_rotor(self, effects, spindle, state)
        n, m, w = balls.number, balls.mass, spindle.speed
        h, x, z = on.h, on.x, balls.height
        nx, ny = on.c * spindle.cos - on.s * spindle.sin, on.s * spindle.cos + on.c * spindle.sin
        load, along = relative_load(effects, balls, on, w)
        ox, oy, oz = state[10:13]
        # Om along n and t, and the ball's velocity relative to the deck.
        o_n, o_t = ox * nx + oy * ny, oy * nx - ox * ny
        v_n, v_t = -w * x, w * h + on.path
        # b = Om (Om.r) - r Om^2 + 2 Om x v, along n, t and z, as inertial force.
        om_r, om_2 = h * o_n + x * o_t + z * oz, o_n * o_n + o_t * o_t + oz * oz
        load = load - m * (o_n * om_r - h * om_2 - 2.0 * oz * v_t)
        along = along - m * (o_t * om_r - x * om_2 + 2.0 * oz * v_n)
        axial = -m * (oz * om_r - z * om_2 + 2.0 * (o_n * v_t - o_t * v_n))
        coupling = [m * ny, -(m * nx), 0.0, m * z * nx, m * z * ny, -(m * h), -(m * h)]
        normal_coupling = [-(m * nx), -(m * ny), 0.0, m * z * ny, -(m * z * nx), m * x, m * x]
        _add_point_masses(block, n, m, h * nx - x * ny, h * ny + x * nx, z)
        # Moment of each ball's inertial force about C, along n, t and z.
        t_n, t_t, t_z = x * axial - z * along, z * load - h * axial, h * along - x * load
        for r, force_of_balls in enumerate(
            [
                *(load * nx - along * ny, load * ny + along * nx, axial),
                *(t_n * nx - t_t * ny, t_n * ny + t_t * nx, t_z, t_z),
            ]
        ):
            force[r] = force[r] + over_balls(n, force_of_balls)
        if any_has(effects, "ball_inertia"):
            I_over_a = over_effects(effects, "ball_inertia", 0.0, balls.each) * balls.radius
            inertia = over_balls(n, I_over_a * balls.radius)
            spin_momentum = over_balls(n, I_over_a * (balls.radius * w - on.path))
            for r, s in ((3, 3), (4, 4), (5, 5), (5, 6), (6, 6)):
                block[r][s] = block[r][s] + inertia
            coupling[5], coupling[6] = coupling[5] + I_over_a, coupling[6] + I_over_a
            force[3] = force[3] - spin_momentum * oy
            force[4] = force[4] + spin_momentum * ox
        return Arrow(
            block, force, coupling, normal_coupling, load, along + drag_force(effects, balls, on)
        )

    def rates(
        self, effects: Any, spindle: SpindleMotion, state: State, x: Sequence[Number]
    ) -> list[Number]:
        """Return the rates of change of the deck's states, from the accelerations x."""
        quaternion, g = state[3:7], self.gravity
        ax, ay, az = to_ground(turn_of(quaternion), x[0], x[1], x[2])
        return [
            *state[7:10],
            *half_product(quaternion, *state[10:13]),
            *(ax + g[0], ay + g[1], az + g[2]),
            *x[3:6],
        ]

    def channels(
        self, effects: Any, spindle: SpindleMotion, state: State, x: Sequence[Number]
    ) -> list[Number]:
        """Return the numbers of a sample that describe the deck's displacement and rotation.

        Order: displacement, velocity and acceleration of C on the ground's axes; quaternion;
        angular velocity and acceleration on deck axes.
        """
        a, b, c, d = state[3:7]
        length = sqrt(a * a + b * b + c * c + d * d)
        changes = self.rates(effects, spindle, state, x)
        return [
            *(*state[:3], *state[7:10], *changes[7:10]),
            *(a / length, b / length, c / length, d / length),
            *(*state[10:13], *x[3:6]),
        ]

    def dissipated(self, effects: Any, spindle: SpindleMotion, state: State) -> Number:
        """Return the power that the mounts dissipate [W]."""
        return mount_loss(self, turn_of(state[3:7]), state)

    def jump(self, state: State, jumps: Sequence[Number]) -> list[Number]:
        """Return the change of the state at an impact.

        Parameters
        ----------
        state
            State before the impact.
        jumps
            Jumps of C's velocity [m/s] and of Om [rad/s], on deck axes, in the order of x.
        """
        velocity = to_ground(turn_of(state[3:7]), jumps[0], jumps[1], jumps[2])
        return [*[0.0] * 7, *velocity, *jumps[3:6]]

    def place(self, states: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Return the position of C on the ground's axes [m], shape (samples, 3)."""
        return states[:, :3]

    def specific_force(self, effects: Any, channels: State, point: Sequence[float]) -> list[Number]:
        """Return the specific force at a point of the deck, on deck axes [m/s^2]."""
        # No matrix product: its rounding depends on the processor.
        fall = [a - g for a, g in zip(channels[6:9], self.gravity, strict=True)]
        rates, change = channels[13:16], channels[16:19]
        force = to_deck(turn_of(channels[9:13]), fall[0], fall[1], fall[2])
        tangential, inwards = cross(change, point), cross(rates, cross(rates, point))
        return [f + t + i for f, t, i in zip(force, tangential, inwards, strict=True)]

    def at_rest(self, states: np.ndarray) -> np.ndarray:
        """Return the channels of a deck at rest in the position and orientation of ``states``.

        The result has the shape (1, 19).
        """
        row = np.zeros((1, 19))
        row[0, :3], row[0, 9:13] = states[:3], states[3:7] / np.linalg.norm(states[3:7])
        return row

    def scale(self, length: float, speed: float) -> list[float]:
        """Return magnitudes of the states, from a length [m] and a spindle speed [rad/s]."""
        return [*[length] * 3, *[1.0] * 4, *[length * speed] * 3, *[speed] * 3]

    def tangent(self, states: np.ndarray) -> np.ndarray:
        """Return directions of all changes of the state except of the quaternion's length.

        The result has the shape (13, 12), one direction per column.

        A small turn by phi on deck axes adds q (0, phi) / 2 to the quaternion q.
        """
        w, x, y, z = states[3:7] / np.linalg.norm(states[3:7])
        ways = np.zeros((13, 12))
        ways[:3, :3], ways[7:, 6:] = np.eye(3), np.eye(6)
        ways[3:7, 3:6] = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
        return ways

    def energy(
        self, effects: Any, balls: BallConstants, state: np.ndarray, psi: float, speed: float
    ) -> float:
        """Return kinetic and stored energy [J]; the energy of gravity is 0 with C at the origin."""
        turn = np.array(turn_of(state[3:7].tolist())).reshape(3, 3)
        velocity, omega = ordered_dot(turn.T, state[7:10]), np.array(state[10:13])
        shaft = np.array([0.0, 0.0, 1.0])
        moments = _turned_second_moments(self.rotor_second, cos(psi), sin(psi))
        rotor = np.array([self.unbalance * cos(psi), self.unbalance * sin(psi), self.rotor_first_z])
        spinning = omega + speed * shaft
        square = ordered_dot(velocity, velocity)
        energy = 0.5 * (self.total_mass - float(np.sum(balls.mass))) * float(square)
        first = np.array(self.deck_first)
        energy += float(ordered_dot(velocity, np.cross(omega, first) + np.cross(spinning, rotor)))
        inertia = symmetric(self.deck_inertia)
        energy += 0.5 * float(ordered_dot(omega, ordered_dot(inertia, omega)))
        tensor = symmetric(moments)
        inertia = np.trace(tensor) * np.eye(3) - tensor
        energy += 0.5 * float(ordered_dot(spinning, ordered_dot(inertia, spinning)))
        gravity = ordered_dot(turn.T, self.gravity)
        energy -= float(ordered_dot(gravity, first + rotor))
        energy -= self.total_mass * float(ordered_dot(self.gravity, state[:3]))
        n = balls.number
        theta, rate = state[13 : 13 + n], state[13 + n : 13 + 2 * n]
        on = on_race(effects, balls, np.cos(theta), np.sin(theta), rate)
        normal = np.stack([np.cos(theta + psi), np.sin(theta + psi), np.zeros(n)], axis=1)
        along = np.cross(shaft, normal)
        place = _each(on.h, n) * normal + _each(on.x, n) * along + _each(balls.height, n) * shaft
        moving = velocity + np.cross(spinning, place) + _each(on.path, n) * along
        energies = 0.5 * balls.mass * np.sum(moving**2, axis=1) - balls.mass * ordered_dot(
            place, gravity
        )
        if any_has(effects, "ball_inertia"):
            surface = _each(balls.radius, n) * spinning - _each(on.path, n) * shaft
            inertia = over_effects(effects, "ball_inertia", 0.0, balls.each)
            energies = energies + 0.5 * inertia * np.sum(surface**2, axis=1)
        stored = mount_energy(self, effects, tuple(turn.ravel()), state.tolist())
        return float(energy + np.sum(energies) + stored)


def _each(value: Any, balls: int) -> np.ndarray:
    """Return one number, or one per ball, as a column of shape (balls, 1)."""
    return np.broadcast_to(np.asarray(value, float), balls)[:, None]


def symmetric(six: Sequence[float]) -> np.ndarray:
    """Return the symmetric 3 x 3 matrix with the elements xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _turned_second_moments(
    second_moments: Sequence[Number], c: Number, s: Number
) -> tuple[Number, ...]:
    """Return second moments on deck axes of a body that turns with the spindle.

    Order: xx, yy, zz, xy, xz, yz.
    """
    xx, yy, zz, xy, xz, yz = second_moments
    return (
        c * c * xx - 2.0 * c * s * xy + s * s * yy,
        s * s * xx + 2.0 * c * s * xy + c * c * yy,
        zz,
        c * s * (xx - yy) + (c * c - s * s) * xy,
        c * xz - s * yz,
        s * xz + c * yz,
    )


def _deck_and_rotor(
    deck: Any, effects: Any, spindle: SpindleMotion, state: State
) -> tuple[list[list[Number]], list[Number]]:
    """Return the equations of deck and rotor without balls: matrix, upper triangle, and forces.

    The unknowns are A, Om' and al, as in the module's docstring.
    """
    w, c, s, (ox, oy, oz) = spindle.speed, spindle.cos, spindle.sin, state[10:13]
    fx, fy, fz, tx, ty, tz = mount_forces(deck, effects, turn_of(state[3:7]), state)
    # The rotor at its present angle.
    rx, ry = deck.unbalance * c, deck.unbalance * s
    pxx, pyy, pzz, pxy, pxz, pyz = _turned_second_moments(deck.rotor_second, c, s)
    sx, sy = deck.deck_first[0] + rx, deck.deck_first[1] + ry
    sz = deck.deck_first[2] + deck.rotor_first_z
    jxx, jyy, jzz, jxy, jxz, jyz = deck.deck_inertia
    jxx, jyy, jzz = jxx + pyy + pzz, jyy + pxx + pzz, jzz + pxx + pyy
    jxy, jxz, jyz = jxy - pxy, jxz - pxz, jyz - pyz
    M, polar = deck.total_mass, pxx + pyy
    block = [
        [M, 0.0, 0.0, 0.0, sz, -sy, -ry],
        [0.0, M, 0.0, -sz, 0.0, sx, rx],
        [0.0, 0.0, M, sy, -sx, 0.0, 0.0],
        [0.0, 0.0, 0.0, jxx, jxy, jxz, -pxz],
        [0.0, 0.0, 0.0, 0.0, jyy, jyz, -pyz],
        [0.0, 0.0, 0.0, 0.0, 0.0, jzz, polar],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, polar],
    ]
    # Om x (Om x S) = Om (Om.S) - S Om^2, and 2 w Om x V.
    along, square = ox * sx + oy * sy + oz * sz, ox * ox + oy * oy + oz * oz
    lx = jxx * ox + jxy * oy + jxz * oz
    ly = jxy * ox + jyy * oy + jyz * oz
    lz = jxz * ox + jyz * oy + jzz * oz
    px = pxx * ox + pxy * oy + pxz * oz
    py = pxy * ox + pyy * oy + pyz * oz
    force = [
        fx - (ox * along - sx * square) + 2.0 * w * oz * rx + w * w * rx,
        fy - (oy * along - sy * square) + 2.0 * w * oz * ry + w * w * ry,
        fz - (oz * along - sz * square) - 2.0 * w * (ox * rx + oy * ry),
        tx - (oy * lz - oz * ly) - 2.0 * w * py - w * w * pyz,
        ty - (oz * lx - ox * lz) + 2.0 * w * px + w * w * pxz,
        tz - (ox * ly - oy * lx),
        spindle.torque - (oy * px - ox * py),
    ]
    return block, force


def _add_point_masses(
    block: list[list[Number]], n: int, m: Number, x: Number, y: Number, z: Number
) -> None:
    """Add a point mass per ball, at (x, y, z) and turning with the spindle, to the block.

    The total mass M on the block's diagonal already includes them.
    """
    sx, sy, sz = m * x, m * y, m * z
    sum_x, sum_y, sum_z = (over_balls(n, moment) for moment in (sx, sy, sz))
    xx, yy, zz = over_balls(n, sx * x), over_balls(n, sy * y), over_balls(n, sz * z)
    xy, xz, yz = over_balls(n, sx * y), over_balls(n, sx * z), over_balls(n, sy * z)
    for r, q, added in (
        *((0, 4, sum_z), (0, 5, -sum_y), (1, 3, -sum_z), (1, 5, sum_x), (2, 3, sum_y)),
        *((2, 4, -sum_x), (3, 3, yy + zz), (4, 4, xx + zz), (5, 5, xx + yy), (3, 4, -xy)),
        *((3, 5, -xz), (4, 5, -yz), (0, 6, -sum_y), (1, 6, sum_x), (3, 6, -xz)),
        *((4, 6, -yz), (5, 6, xx + yy), (6, 6, xx + yy)),
    ):
        block[r][q] = block[r][q] + added

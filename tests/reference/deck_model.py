"""Lagrangian of the deck in space, on ground axes, with a dense mass matrix.

Coordinates q = (X, Y, Z, alpha, beta, gamma, psi, psi_1 .. psi_n): C on ground axes, the 3-1-2
angles (gamma about Z, alpha about the turned x, beta about the last y), the spindle's angle
relative to the deck, and psi_i = psi + phi_i. With the poses H_b(q) of all bodies, their
pseudo-inertias P_b and gravity G = [0, g; 0, 0],

    M_jk = sum_b tr(dH_b/dq_j P_b (dH_b/dq_k)^T)
    sum_k M_jk q_k'' + sum_b tr(dH_b/dq_j P_b (H_b''|_{q''=0} - G)^T) = Q_j

which are Lagrange's equations, because every H_b is a function of q alone (a rolling ball turns by
psi - s/a, with s its path along the race). Q is that of the mounts, J^T f at their points, and of
drag.
"""

from typing import NamedTuple

import numpy as np

from .deck_params import DeckParams
from .plant import Array, Curve, Plant, System
from .pose import SHIFT, TURN, Number, Pose, linear, pseudo_inertia, shift, shifted

ANGLES = ((TURN[2], 5), (TURN[0], 3), (TURN[1], 4))
"""Rotations gamma, alpha, beta, with the indices of their coordinates."""
OWN = 7
"""Number of coordinates of poses before psi_i: the deck's six, and psi."""


class Poses(NamedTuple):
    """Poses of all bodies."""

    deck: Pose
    bodies: Pose
    """Poses of deck, disc and balls."""
    outward: Array
    """Outward normal n of each ball's race on ground axes."""


class MountPoints(NamedTuple):
    """Displacements and velocities at the mounts, one row each, on ground axes."""

    displacement: Array
    velocity: Array
    slopes: Array
    """Derivatives of the displacement by the deck's coordinates."""


class DeckModel(Plant):
    """DeckParams with constants derived from them."""

    def __init__(self, p: DeckParams) -> None:
        self.p, self.psi, self.count = p, 6, len(p.balls)
        sizes = np.array([len(race.balls) for race in p.races], int)
        ends = np.append(0, np.cumsum(sizes))
        self.races = tuple(np.arange(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True))

        def of_race(*values: float) -> Array:
            return np.repeat(np.array(values, float), sizes)

        self.curve = Curve(
            of_race(*(race.radius for race in p.races)),
            of_race(*(race.runout.oval for race in p.races)),
            of_race(*(race.runout.oval_angle for race in p.races)),
        )
        self.drag = of_race(*(race.drag / race.radius**2 for race in p.races))
        self.masses = np.array([ball.mass for ball in p.balls])
        self.radii = np.array([ball.radius for ball in p.balls])
        rolling = (ball.radius if ball.inertia else np.inf for ball in p.balls)
        self.spin_per_way = 1.0 / np.array([*rolling])
        arm = p.friction.arm / self.radii if p.friction.arm else np.zeros(self.count)
        self.coefficients = arm + p.friction.constant
        self.scales = (1e-5,) * 3 + (1e-4,) * 3, (1e-3,) * 3 + (1e-2,) * 3

        centres = [[*race.runout.offset, race.height] for race in p.races]
        self.race_centres = shift(np.repeat(np.reshape(centres, (-1, 3)), sizes, axis=0))
        self.inertias = np.array([deck_inertia(p), disc_inertia(p), *ball_inertias(p)])
        self.weight = np.zeros((4, 4))
        self.weight[:3, 3] = p.gravity
        self.places = np.array([[*mount.position, 1.0] for mount in p.mounts]).reshape(-1, 4)
        axes = np.array([mount.axes for mount in p.mounts], float).reshape(-1, 3, 3)
        self.stiffness, self.damping = (
            np.einsum("mij,mj,mkj->mik", axes, np.reshape(values, (-1, 3)), axes)
            for values in ([m.stiffness for m in p.mounts], [m.damping for m in p.mounts])
        )
        self.cubic = np.array([mount.cubic for mount in p.mounts])

    def poses(self, q: Array, rates: Array) -> Poses:
        """Return the poses of all bodies and their derivatives."""
        unit = np.eye(8)
        deck = shifted(q[:3], rates[:3], 8)
        for generator, j in ANGLES:
            deck = deck.then(generator, linear(unit[j], q[j], rates[j]))
        disc = deck.then(TURN[2], linear(unit[6], q[6], rates[6]))
        theta = linear(unit[OWN] - unit[6], self.theta(q), self.theta(rates))
        h, dh, path, dpath = self.curve.at(theta.value)
        normal = disc.fixed(self.race_centres).then(TURN[2], theta)
        balls = normal.then(SHIFT[0], theta.through(h, dh, path - h))
        balls = balls.then(SHIFT[1], theta.through(dh, path - h, dpath - dh))
        balls = balls.then(TURN[2], self._rolled(theta, path, dpath))
        bodies = Pose(np.concatenate([deck.parts[None], disc.parts[None], balls.parts]))
        return Poses(deck, bodies, normal.value[:, :3, 0])

    def _rolled(self, theta: Number, path: Array, dpath: Array) -> Number:
        """Return -theta - s/a: the frame of a ball has turned with theta, it by psi - s/a."""
        swell = 1.5 * self.curve.oval * np.sin(2.0 * (theta.value - self.curve.oval_angle))
        way, spin = self.curve.radius * theta.value - swell, self.spin_per_way
        return theta.through(-theta.value - spin * way, -1.0 - spin * path, -spin * dpath)

    def mount_points(self, deck: Pose) -> MountPoints:
        """Return displacement and velocity of the mounts' points from their relaxed positions."""
        displacement = (self.places @ deck.value.T - self.places)[:, :3]
        velocity = (self.places @ deck.rate.T)[:, :3]
        slopes = np.moveaxis(deck.slopes[:6] @ self.places.T, -1, 0)[:, :, :3]
        return MountPoints(displacement, velocity, slopes)

    def system(self, q: Array, rates: Array) -> System:
        """Return the equations of motion; N = -m (P'' - g) . n."""
        poses = self.poses(q, rates)
        bodies, many = poses.bodies, 2 + self.count
        slopes = bodies.slopes.reshape(many, 8, 16)
        weighted = (slopes.reshape(many, 32, 4) @ self.inertias).reshape(many, 8, 16)
        masses = weighted @ slopes.swapaxes(1, 2)
        forces = -times(weighted, (bodies.bias - self.weight).reshape(many, 16))
        mass = np.zeros((self.size, self.size), masses.dtype)
        known = np.zeros(self.size, forces.dtype)
        mass[:7, :7], known[:7] = masses[:, :7, :7].sum(axis=0), forces[:, :7].sum(axis=0)
        mass[7:, :7], mass[:7, 7:] = masses[2:, OWN, :7], masses[2:, OWN, :7].T
        mass[7:, 7:], known[7:] = np.diag(masses[2:, OWN, OWN]), forces[2:, OWN]

        at = self.mount_points(poses.deck)
        damper = times(self.damping, at.velocity)
        force = -times(self.stiffness, at.displacement) - damper
        square = np.sum(at.displacement**2, axis=1)
        force = force - (self.cubic * square)[:, None] * at.displacement
        known[:6] += np.einsum("mji,mi->j", at.slopes, force)
        _, _, path, _ = self.curve.at(self.theta(q))
        drag = -self.drag * path**2 * self.theta(rates)
        known[7:] += drag
        known[6] -= drag.sum()

        pull = -self.masses[:, None] * poses.outward
        lever = np.einsum("ni,nji->nj", pull, bodies.slopes[2:, :, :3, 3])
        rows = np.concatenate([lever[:, :7], np.diag(lever[:, OWN])], axis=1)
        against = np.sum(pull * (bodies.bias[2:, :3, 3] - self.weight[:3, 3]), axis=1)
        return System(mass, known, rows, against, path, np.sum(damper * at.velocity))

    def kinetic_energy(self, q: Array, rates: Array) -> float:
        """Return the kinetic energy of all bodies, the disc's spin included [J]."""
        moving = self.poses(q, rates).bodies.rate
        return 0.5 * np.einsum("bij,bjk,bik->", moving, self.inertias, moving)

    def potential_energy(self, q: Array) -> float:
        """Return the energy of springs, and of gravity from the ground's origin [J]."""
        poses = self.poses(q, np.zeros(self.size))
        u = self.mount_points(poses.deck).displacement
        springs = 0.5 * np.sum(u * times(self.stiffness, u))
        springs += 0.25 * self.cubic @ np.sum(u**2, axis=1) ** 2
        moment = np.einsum("bij,bj->i", poses.bodies.value, self.inertias[:, :, 3])
        return springs - moment[:3] @ self.weight[:3, 3]

    def energy(self, q: Array, rates: Array) -> float:
        """Return the kinetic energy plus that of springs and gravity [J]."""
        return self.kinetic_energy(q, rates) + self.potential_energy(q)

    def momentum(self, q: Array, rates: Array) -> tuple[Array, Array]:
        """Return momentum and angular momentum about the ground's origin, on ground axes."""
        bodies = self.poses(q, rates).bodies
        products = np.einsum("bij,bjk,blk->il", bodies.value, self.inertias, bodies.rate)
        turning = (products - products.T)[[1, 2, 0], [2, 0, 1]]
        return products[3, :3], turning

    def specific_force(
        self, q: Array, rates: Array, accelerations: Array, point: Array, axes: Array
    ) -> Array:
        """Return P'' - g at a point along the rows of ``axes``, both on deck axes [m/s^2]."""
        deck, place = self.poses(q, rates).deck, np.append(point, 1.0)
        gain = np.einsum("jik,j,k->i", deck.slopes[:6], accelerations[:6], place)
        felt = (gain + (deck.bias - self.weight) @ place)[:3]
        return np.asarray(axes) @ deck.value[:3, :3].T @ felt


def times(matrices: Array, vectors: Array) -> Array:
    """Return the product of each matrix and its vector."""
    return (matrices @ vectors[..., None])[..., 0]


def deck_inertia(p: DeckParams) -> Array:
    """Return the pseudo-inertia of the deck on its axes."""
    return pseudo_inertia(p.deck.mass, np.array(p.deck.com), np.array(p.deck.inertia))


def disc_inertia(p: DeckParams) -> Array:
    """Return the pseudo-inertia of all parts that turn with the spindle, on disc axes."""
    made = pseudo_inertia(p.disc.mass, p.disc.com, np.array(p.disc.inertia))
    for mass, position in p.disc.points:
        made += pseudo_inertia(mass, np.array(position), np.zeros((3, 3)))
    if p.motor is not None:
        made += pseudo_inertia(0.0, np.zeros(3), np.diag([0.0, 0.0, p.motor.inertia]))
    return made


def ball_inertias(p: DeckParams) -> list[Array]:
    """Return the pseudo-inertias of the balls on their axes."""
    return [pseudo_inertia(b.mass, np.zeros(3), b.inertia * np.eye(3)) for b in p.balls]

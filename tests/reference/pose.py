"""Poses as products of exponentials, carried along with their derivatives.

A body's pose is a homogeneous 4 x 4 matrix H = [B, r; 0, 1], and every pose here is a product

    H = exp(G_1 u_1) exp(G_2 u_2) ...

of rotations about and shifts along one axis each, by numbers u_k(q) of the coordinates (Brockett's
formula; Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation (1994), ch. 3).
As d exp(G u) / du = exp(G u) G for both, the product rule gives dH/dq and H'' factor by factor.
There are no angular velocities and no gyroscopic terms: H'' has them.

Arrays may be complex, for derivatives by complex steps.
"""

from typing import NamedTuple

import numpy as np

from .plant import Array


class Generator(NamedTuple):
    """G of a motion exp(G u), and its square."""

    matrix: Array
    square: Array
    turns: bool
    """A rotation, with G^3 = -G; a shift has G^2 = 0."""


def _generator(turns: bool, *entries: tuple[int, int, float]) -> Generator:
    made = np.zeros((4, 4))
    for row, column, value in entries:
        made[row, column] = value
    return Generator(made, made @ made, turns)


TURN = (
    _generator(True, (2, 1, 1.0), (1, 2, -1.0)),
    _generator(True, (0, 2, 1.0), (2, 0, -1.0)),
    _generator(True, (1, 0, 1.0), (0, 1, -1.0)),
)
"""Rotations about x, y, z."""
SHIFT = tuple(_generator(False, (axis, 3, 1.0)) for axis in range(3))
"""Shifts along x, y, z."""
ONE = np.eye(4)


class Number(NamedTuple):
    """A function u(q), or a row of them, at one state: u, du/dq, u' and u'' where q'' = 0."""

    value: Array
    slopes: Array
    """One more, last, index: the coordinate."""
    rate: Array
    bias: Array

    def through(self, f: Array, df: Array, ddf: Array) -> "Number":
        """f(u), with its first and second derivative by u."""
        slopes = np.asarray(df)[..., None] * self.slopes
        return Number(f, slopes, df * self.rate, df * self.bias + ddf * self.rate**2)


def linear(weights: Array, q: Array, rates: Array) -> Number:
    """weights . q."""
    return Number(q @ weights, weights, rates @ weights, np.zeros(q.shape[:-1]))


class Pose(NamedTuple):
    """H, or a row of them, at one state: H, dH/dq, H' and H'' where q'' = 0."""

    value: Array
    slopes: Array
    """One more index before the matrix's two: the coordinate."""
    rate: Array
    bias: Array

    def then(self, generator: Generator, u: Number) -> "Pose":
        """H exp(G u)."""
        motion = exponential(generator, u.value)
        value, rate = self.value @ motion, self.rate @ motion
        along, speed = value @ generator.matrix, u.rate[..., None, None]
        slopes = self.slopes @ motion[..., None, :, :]
        bias = self.bias @ motion + (2.0 * speed) * (rate @ generator.matrix)
        if generator.turns:
            bias = bias + speed**2 * (value @ generator.square)
        return Pose(
            value,
            slopes + along[..., None, :, :] * u.slopes[..., None, None],
            rate + along * speed,
            bias + along * u.bias[..., None, None],
        )

    def fixed(self, motion: Array) -> "Pose":
        """H A with a constant A."""
        inside = motion[..., None, :, :]
        return Pose(
            self.value @ motion, self.slopes @ inside, self.rate @ motion, self.bias @ motion
        )


def exponential(generator: Generator, u: Array) -> Array:
    """exp(G u): 1 + G u of a shift, by Rodrigues' formula of a rotation."""
    u = np.asarray(u)[..., None, None]
    if not generator.turns:
        return ONE + generator.matrix * u
    return ONE + generator.matrix * np.sin(u) + generator.square * (1.0 - np.cos(u))


def shift(vector: Array) -> Array:
    """The matrix that shifts by a vector, or a row of them."""
    vector = np.asarray(vector, float)
    made = np.broadcast_to(np.eye(4), (*vector.shape[:-1], 4, 4)).copy()
    made[..., :3, 3] = vector
    return made


def shifted(q: Array, rates: Array) -> Pose:
    """The pose of axes that the first three of the coordinates shift from the ground's."""
    slopes = np.zeros((len(q), 4, 4))
    slopes[[0, 1, 2], [0, 1, 2], 3] = 1.0
    value, rate = (np.tensordot(v[:3], slopes[:3], axes=1) for v in (q, rates))
    return Pose(ONE + value, slopes, rate, np.zeros((4, 4)))


def pseudo_inertia(mass: float, centre: Array, inertia: Array) -> Array:
    """P, the integral of (p, 1) (p, 1)^T dm over a body, p on its axes [kg m^2, kg m, kg].

    Then 2 T = tr(H' P H'^T), the generalised inertial force is tr(dH/dq P H''^T) (Uicker's
    matrices), and no point of the body is special.

    Args:
        mass: of the body.
        centre: its centre of mass, from the origin of the axes.
        inertia: about the centre of mass; a product of inertia is *minus* the integral of x y dm.
    """
    place = np.append(centre, 1.0)
    made = mass * np.outer(place, place)
    made[:3, :3] += 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return made

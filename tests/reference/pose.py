"""Poses as products of exponentials, with their derivatives.

A body's pose is a homogeneous 4 x 4 matrix H = [B, r; 0, 1], and every pose here is a product

    H = exp(G_1 u_1) exp(G_2 u_2) ...

of rotations about and shifts along one axis each, by numbers u_k(q) of the coordinates (Brockett's
formula; Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation (1994), ch. 3).
Because d exp(G u) / du = exp(G u) G for both, the product rule gives dH/dq and H'' factor by
factor. There are no angular velocities and no gyroscopic terms: H'' includes them.

Arrays may be complex, for derivatives by complex steps.
"""

from typing import NamedTuple

import numpy as np

from .plant import Array


class Generator(NamedTuple):
    """Generator G of a motion exp(G u), and its square."""

    matrix: Array
    square: Array
    turns: bool
    """True for a rotation, with G^3 = -G; a shift has G^2 = 0."""


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
    """Function u(q), or a row of functions, at one state."""

    value: Array
    gains: Array
    """u', u'' for q'' = 0, and du/dq, along an additional last index."""

    def through(self, f: Array, df: Array, ddf: Array) -> "Number":
        """Return f(u), from its first and second derivative by u."""
        gains = np.asarray(df)[..., None] * self.gains
        gains[..., 1] += ddf * self.gains[..., 0] ** 2
        return Number(f, gains)


def linear(weights: Array, value: Array, rate: Array) -> Number:
    """Return weights . q, with its value and its rate."""
    rate = np.asarray(rate)
    gains = np.zeros((*rate.shape, 2 + len(weights)), rate.dtype)
    gains[..., 0], gains[..., 2:] = rate, weights
    return Number(value, gains)


class Pose(NamedTuple):
    """Pose H, or a row of poses, at one state."""

    parts: Array
    """H, H', H'' for q'' = 0, and dH/dq, along the index before those of the matrix."""

    @property
    def value(self) -> Array:
        """Return H."""
        return self.parts[..., 0, :, :]

    @property
    def rate(self) -> Array:
        """Return H'."""
        return self.parts[..., 1, :, :]

    @property
    def bias(self) -> Array:
        """Return H'' for q'' = 0."""
        return self.parts[..., 2, :, :]

    @property
    def slopes(self) -> Array:
        """Return dH/dq, with the coordinate's index before those of the matrix."""
        return self.parts[..., 3:, :, :]

    def then(self, generator: Generator, u: Number) -> "Pose":
        """Return H exp(G u)."""
        moved = self.fixed(exponential(generator, u.value))
        speed = u.gains[..., 0, None, None]
        bend = (2.0 * speed) * (moved.rate @ generator.matrix)
        if generator.turns:
            bend = bend + speed**2 * (moved.value @ generator.square)
        along = moved.value @ generator.matrix
        parts = moved.parts.astype(np.result_type(moved.parts, u.gains), copy=False)
        parts[..., 1:, :, :] += u.gains[..., None, None] * along[..., None, :, :]
        parts[..., 2, :, :] += bend
        return Pose(parts)

    def fixed(self, motion: Array) -> "Pose":
        """Return H A with a constant A."""
        *many, count, _, _ = self.parts.shape
        rows = self.parts.reshape(*many, 4 * count, 4) @ motion  # quicker than one by one
        return Pose(rows.reshape(*rows.shape[:-2], count, 4, 4))


def exponential(generator: Generator, u: Array) -> Array:
    """Return exp(G u): 1 + G u for a shift, Rodrigues' formula for a rotation."""
    u = np.asarray(u)[..., None, None]
    if not generator.turns:
        return ONE + generator.matrix * u
    return ONE + generator.matrix * np.sin(u) + generator.square * (1.0 - np.cos(u))


def shift(vector: Array) -> Array:
    """Return the matrix that shifts by a vector, or a row of matrices."""
    vector = np.asarray(vector, float)
    made = np.broadcast_to(np.eye(4), (*vector.shape[:-1], 4, 4)).copy()
    made[..., :3, 3] = vector
    return made


def shifted(place: Array, rate: Array, coordinates: int) -> Pose:
    """Return the pose of axes that the first three coordinates shift from the ground's axes."""
    parts = np.zeros((3 + coordinates, 4, 4), np.result_type(place, rate))
    parts[0] = ONE
    parts[0, :3, 3], parts[1, :3, 3] = place, rate
    parts[[3, 4, 5], [0, 1, 2], 3] = 1.0
    return Pose(parts)


def pseudo_inertia(mass: float, centre: Array, inertia: Array) -> Array:
    """Return P, the integral of (p, 1) (p, 1)^T dm over a body, p on its axes [kg m^2, kg m, kg].

    Then 2 T = tr(H' P H'^T), and the generalised inertial force is tr(dH/dq P H''^T) (Uicker's
    matrices), for any reference point of the body.

    Parameters
    ----------
    mass
        Mass of the body [kg].
    centre
        Centre of mass from the origin of the axes [m].
    inertia
        Inertia about the centre of mass; a product is *minus* the integral of x y dm.
    """
    place = np.append(centre, 1.0)
    made = mass * np.outer(place, place)
    made[:3, :3] += 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return made

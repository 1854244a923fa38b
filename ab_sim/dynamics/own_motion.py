"""Linear motion of the carrier of the balls: x'' + c x' + k x = 0 in each coordinate.

A method that solves this part of the equations exactly (ab_sim/collocation) writes all other terms
as a force f on the right. The linear part may be incomplete; the rest of it is then contained in f.
"""

import math

import numpy as np

from ab_sim.dynamics.linearised import Linearised

EIGHT = 8
"""Number of columns of a table."""
DAMPINGS, STIFFNESSES, FROM_MODES, TO_MODES = 0, 1, 2, 9
"""First rows of a table with a column for each coordinate: c [1/s], k [1/s^2], and for a deck in
space the matrix from its modes, see ``in_modes``, and its inverse. The column after the coordinates
has c of the spindle's speed with a motor."""
LINES = 16


def alike(motion: Linearised) -> np.ndarray:
    """Return the mean motion for coordinates with one common mass; shape (LINES, 8)."""
    table, ways, mass = np.zeros((LINES, EIGHT)), len(motion.mass), motion.mass[0, 0]
    table[DAMPINGS, :ways] = max(0.0, float(np.trace(motion.damping)) / ways / mass)
    table[STIFFNESSES, :ways] = max(0.0, float(np.trace(motion.stiffness)) / ways / mass)
    return table


def in_modes(motion: Linearised, length: float) -> np.ndarray:
    """Return undamped modes of a deck in space without gyroscopic terms; shape (LINES, 8).

    FROM_MODES are seven rows. They convert x, six modes and the quaternion's real part, to X, Y, Z
    [m] and the quaternion as x, y, z, w. Each mode is scaled as a length: its largest displacement,
    or turn times ``length``, is x itself.

    Args:
        motion: small motions in X, Y, Z and turns about three axes.
        length: factor that makes an angle comparable with X, Y, Z [m].
    """
    # M = L L^T turns the problem into one for a symmetric matrix.
    root = np.linalg.inv(np.linalg.cholesky(motion.mass))
    _, turn = np.linalg.eigh(root @ motion.stiffness @ root.T)
    modes = root.T @ turn
    modes /= np.abs(modes * np.repeat([1.0, length], 3)[:, None]).max(axis=0)
    mass, damping, stiffness = (
        np.einsum("iq,ij,jq->q", modes, matrix, modes)
        for matrix in (motion.mass, motion.damping, motion.stiffness)
    )
    table = np.zeros((LINES, EIGHT))
    table[DAMPINGS, :6] = np.maximum(damping / mass, 0.0)
    table[STIFFNESSES, :6] = np.maximum(stiffness / mass, 0.0)
    # A small turn phi is the quaternion (1, phi / 2).
    modes[3:] *= 0.5
    table[FROM_MODES : FROM_MODES + 6, :6] = modes
    table[TO_MODES : TO_MODES + 6, :6] = np.linalg.inv(modes)
    table[FROM_MODES + 6, 6], table[TO_MODES + 6, 6] = 0.5 / length, 2.0 * length
    return table


def length_beside_turns(radius: float | None, motion: Linearised) -> float:
    """Return the race's radius, or without a race the radius of gyration [m]."""
    if radius is not None:
        return radius
    return math.sqrt(float(np.trace(motion.mass[3:, 3:]) / np.trace(motion.mass[:3, :3])))

"""What carries the balls, moving by itself: x'' + c x' + k x = 0 in each of its coordinates.

Who solves that part of the equations exactly (ab_sim/collocation) writes all the rest as a force f
on the right. It need not be all of the linear part: only what is left to f has to be found.
"""

import math

import numpy as np

from ab_sim.dynamics.linearised import Linearised

EIGHT = 8
"""Columns of a table."""
DAMPINGS, STIFFNESSES, FROM_MODES, TO_MODES = 0, 1, 2, 9
"""Lines of a table of floats, a column for each coordinate: c [1/s] and k [1/s^2]; of a deck in
space what its modes make of it, see ``in_modes``, and the inverse. Behind the coordinates stands
c of the spindle's speed under a motor."""
LINES = 16


def alike(motion: Linearised) -> np.ndarray:
    """The mean motion for all coordinates, where they share one mass; shape (LINES, 8)."""
    table, ways, mass = np.zeros((LINES, EIGHT)), len(motion.mass), motion.mass[0, 0]
    table[DAMPINGS, :ways] = max(0.0, float(np.trace(motion.damping)) / ways / mass)
    table[STIFFNESSES, :ways] = max(0.0, float(np.trace(motion.stiffness)) / ways / mass)
    return table


def in_modes(motion: Linearised, length: float) -> np.ndarray:
    """Of a deck in space, undamped and not gyroscopic modes; shape (LINES, 8).

    FROM_MODES are seven lines: of x, which are six modes and the quaternion's real part, they make
    X, Y, Z [m] and the quaternion's other parts, x, y, z, w. Each of x is a length: no more than
    one or the other, times ``length``, is by it.

    Args:
        motion: small motions in X, Y, Z and turns about three axes.
        length: what an angle is multiplied by to be compared with X, Y, Z [m].
    """
    # M = L L^T: the modes are those of a symmetric matrix.
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
    """The race's radius, or without a race that of gyration [m]."""
    if radius is not None:
        return radius
    return math.sqrt(float(np.trace(motion.mass[3:, 3:]) / np.trace(motion.mass[:3, :3])))

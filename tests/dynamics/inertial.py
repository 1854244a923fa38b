"""Equations (2-9)..(2-11) of the thesis as printed, in the inertial frame: an independent model.

A dense linear system for x'', y'', psi_i'' at a given state; it uses nothing of the package.
"""

from typing import NamedTuple

import numpy as np


class Thesis(NamedTuple):
    """Parameters with the symbols of the thesis [SI]; ``spin`` = False omits the balls' spin."""

    M: float
    k: float
    c: float
    e: float
    R: float
    m: float
    a: float
    cb: float
    beta: float = 0.0
    spin: bool = True


def accelerations(
    p: Thesis,
    psi: float,
    w: float,
    al: float,
    deck: np.ndarray,
    angles: np.ndarray,
    rates: np.ndarray,
    rubbing: np.ndarray,
) -> np.ndarray:
    """Return x'', y'', psi_1'', ... from (2-9)..(2-11).

    Parameters
    ----------
    deck
        x, y [m], x', y' [m/s].
    angles, rates
        psi_i [rad], psi_i' [rad/s] (absolute).
    rubbing
        Mask of the balls whose normal force is positive, so that friction acts on them.
    """
    n = len(angles)
    inertia = 0.4 * p.m * p.a**2 if p.spin else 0.0
    matrix = np.zeros((2 + n, 2 + n))
    right = np.zeros(2 + n)
    x, y, vx, vy = deck
    unbalance = (p.M - n * p.m) * p.e
    matrix[0, 0] = matrix[1, 1] = p.M
    s, c = np.sin(angles), np.cos(angles)
    matrix[0, 2:] = -p.m * p.R * s
    matrix[1, 2:] = p.m * p.R * c
    right[0] = -p.c * vx - p.k * x + unbalance * (al * np.sin(psi) + w**2 * np.cos(psi))
    right[1] = -p.c * vy - p.k * y + unbalance * (-al * np.cos(psi) + w**2 * np.sin(psi))
    right[0] += np.sum(p.m * p.R * rates**2 * c)
    right[1] += np.sum(p.m * p.R * rates**2 * s)
    mu = p.beta / p.a * np.sign(rates - w) * rubbing
    for i in range(n):
        matrix[2 + i, 2 + i] = (p.m + inertia / p.a**2) * p.R
        matrix[2 + i, 0] = -p.m * s[i] - p.m * mu[i] * c[i]
        matrix[2 + i, 1] = p.m * c[i] - p.m * mu[i] * s[i]
        right[2 + i] = -p.cb * p.R * (rates[i] - w) - p.m * mu[i] * p.R * rates[i] ** 2
        right[2 + i] += (p.R + p.a) / p.a**2 * inertia * al
    return np.linalg.solve(matrix, right)

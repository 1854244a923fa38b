"""Six coordinates of a deck from a drive's outputs: quaternion and angular velocity.

The angles 3-1-2 turn by gamma about Z, by alpha about the new x, by beta about the last y. The
angular velocity on deck axes (shared/DECK.md) is

    alpha' cos b - gamma' cos a sin b,    beta' + gamma' sin a,    alpha' sin b + gamma' cos a cos b
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ab_sim.drive.trajectory import Trajectory


class Coordinates(NamedTuple):
    """Coordinates, with a row for each sample."""

    places: np.ndarray
    """X, Y, Z [m], alpha, beta, gamma, then the balls' angles [rad], unless stated otherwise."""
    rates: np.ndarray
    """Time derivatives of the coordinates."""


def columns(run: Trajectory, *names: str) -> np.ndarray:
    """Return channels of a run as columns."""
    return np.column_stack([run[name] for name in names])


def tilt_of(quaternions: np.ndarray, turning: np.ndarray) -> Coordinates:
    """Return alpha, beta, gamma and their rates, with a row for each sample.

    Parameters
    ----------
    quaternions
        x, y, z, w, with a row for each sample.
    turning
        Angular velocity on deck axes [rad/s], with a row for each sample.
    """
    gamma, alpha, beta = Rotation.from_quat(quaternions).as_euler("ZXY").T
    wx, wy, wz = turning.T
    alpha_rate = wx * np.cos(beta) + wz * np.sin(beta)
    gamma_rate = (wz * np.cos(beta) - wx * np.sin(beta)) / np.cos(alpha)
    beta_rate = wy - gamma_rate * np.sin(alpha)
    return Coordinates(
        np.column_stack([alpha, beta, np.unwrap(gamma)]),
        np.column_stack([alpha_rate, beta_rate, gamma_rate]),
    )


def coordinates(run: Trajectory) -> Coordinates:
    """Return the coordinates of a run, with gamma unwrapped."""
    turning = columns(run, "wx", "wy", "wz")
    tilt, tilt_rate = tilt_of(columns(run, "qx", "qy", "qz", "qw"), turning)
    return Coordinates(
        np.hstack([run.position, tilt, run.ball_angles]),
        np.hstack([run.velocity, tilt_rate, run.ball_rates]),
    )


def absolute(run: Trajectory) -> Coordinates:
    """Return the coordinates of the reference's plants: X .. gamma, psi, then psi + theta_i."""
    psi, speed = run["angle"][:, None], run["speed"][:, None]
    places, rates = coordinates(run)
    return Coordinates(
        np.hstack([places[:, :6], psi, psi + places[:, 6:]]),
        np.hstack([rates[:, :6], speed, speed + rates[:, 6:]]),
    )

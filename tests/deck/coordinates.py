"""The deck's six coordinates from what a drive shows: its quaternion and its angular velocity.

Angles 3-1-2: turned by gamma about Z, by alpha about the new x, by beta about the last y. With the
angular velocity on deck axes (shared/DECK.md)

    alpha' cos b - gamma' cos a sin b,    beta' + gamma' sin a,    alpha' sin b + gamma' cos a cos b
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ab_sim.drive.trajectory import Trajectory


class Coordinates(NamedTuple):
    """A row for each sample: X, Y, Z, alpha, beta, gamma, then the balls' angles."""

    places: np.ndarray
    rates: np.ndarray
    """Time derivatives."""


def columns(run: Trajectory, *names: str) -> np.ndarray:
    """Channels side by side."""
    return np.column_stack([run[name] for name in names])


def coordinates(run: Trajectory) -> Coordinates:
    """Of a run; gamma unwrapped."""
    quaternions = columns(run, "qx", "qy", "qz", "qw")
    gamma, alpha, beta = Rotation.from_quat(quaternions).as_euler("ZXY").T
    wx, wy, wz = columns(run, "wx", "wy", "wz").T
    alpha_rate = wx * np.cos(beta) + wz * np.sin(beta)
    gamma_rate = (wz * np.cos(beta) - wx * np.sin(beta)) / np.cos(alpha)
    beta_rate = wy - gamma_rate * np.sin(alpha)
    tilt = np.column_stack([alpha, beta, np.unwrap(gamma)])
    tilt_rate = np.column_stack([alpha_rate, beta_rate, gamma_rate])
    return Coordinates(
        np.hstack([run.position, tilt, run.ball_angles]),
        np.hstack([run.velocity, tilt_rate, run.ball_rates]),
    )

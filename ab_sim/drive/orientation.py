"""Orientation of a deck in space: quaternions (w, x, y, z) from deck axes to inertial axes.

Any length is allowed. The last axis of every array has the four numbers.
"""

import numpy as np

NONE = (1.0, 0.0, 0.0, 0.0)
"""Identity rotation."""


def matrix_of(turn: np.ndarray) -> np.ndarray:
    """Return the rotation matrices of quaternions, shape (..., 3, 3)."""
    unit = turn / np.sqrt(np.sum(turn * turn, axis=-1, keepdims=True))
    w, x, y, z = unit[..., 0], unit[..., 1], unit[..., 2], unit[..., 3]
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    rows = (
        *(0.5 - yy - zz, xy - wz, xz + wy),
        *(xy + wz, 0.5 - xx - zz, yz - wx),
        *(xz - wy, yz + wx, 0.5 - xx - yy),
    )
    return 2.0 * np.stack(rows, axis=-1).reshape(*turn.shape[:-1], 3, 3)


def tilt_of(turn: np.ndarray) -> np.ndarray:
    """Return the angles alpha, beta, gamma [rad], each within +-pi, and alpha within +-pi/2.

    The deck is turned by gamma about Z, then by alpha about the new x, then by beta about the last
    y. This is the order of Kim and Chung, Rz(gamma) Rx(alpha) Ry(beta), with their matrix elements.
    """
    turned = matrix_of(turn)
    alpha = np.arcsin(np.clip(turned[..., 2, 1], -1.0, 1.0))
    beta = np.arctan2(-turned[..., 2, 0], turned[..., 2, 2])
    gamma = np.arctan2(-turned[..., 0, 1], turned[..., 1, 1])
    return np.stack([alpha, beta, gamma], axis=-1)

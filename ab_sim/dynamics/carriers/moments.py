"""First and second moments of masses that turn with the spindle of a deck in space."""

from typing import Any

import numpy as np
from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED


def symmetric(six: Any) -> np.ndarray:
    """The matrix of xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@register_jitable(**INLINED)
def turned_second_moments(own: Any, c: Any, s: Any) -> Any:
    """Second moments on deck axes of what turns with the spindle."""
    xx, yy, zz, xy, xz, yz = own
    cross = c * s * (xx - yy) + (c * c - s * s) * xy
    return (
        c * c * xx - 2.0 * c * s * xy + s * s * yy,
        s * s * xx + 2.0 * c * s * xy + c * c * yy,
        zz,
        cross,
        c * xz - s * yz,
        s * xz + c * yz,
    )


@register_jitable(**INLINED)
def add_point_mass(block: Any, m: Any, x: Any, y: Any, z: Any) -> Any:
    """To the block what a mass at (x, y, z) that turns with the spindle adds, M excepted."""
    sx, sy, sz = m * x, m * y, m * z
    block[0, 4] += sz
    block[0, 5] -= sy
    block[1, 3] -= sz
    block[1, 5] += sx
    block[2, 3] += sy
    block[2, 4] -= sx
    block[3, 3] += sy * y + sz * z
    block[4, 4] += sx * x + sz * z
    block[5, 5] += sx * x + sy * y
    block[3, 4] -= sx * y
    block[3, 5] -= sx * z
    block[4, 5] -= sy * z
    block[0, 6] -= sy
    block[1, 6] += sx
    block[3, 6] -= sx * z
    block[4, 6] -= sy * z
    block[5, 6] += sx * x + sy * y
    block[6, 6] += sx * x + sy * y

"""Drawing of balls at the same place, so that each is visible.

Without contact, balls may pass through each other, and balls that start together stay together.
"""

from __future__ import annotations

import numpy as np

from ab_sim.record.recording.layout import Array


def shrunk(angles: Array, race: float, radii: tuple[float, ...]) -> Array:
    """Return the drawn radii of balls, which are smaller for a ball that covers an earlier one.

    Args:
        angles: angles of the balls [rad], shape (rows, balls).
        race: radius of the circle of the balls' centres.
        radii: radii of the balls, in the unit of ``race``.

    Returns:
        Radii in this unit, shape (rows, balls).
    """
    drawn = np.tile(radii, (len(angles), 1))
    for ball in range(1, len(radii)):
        inside = np.minimum(radii[ball], 0.62 * drawn[:, :ball])
        cover = _cover(angles, ball, race, radii[ball])
        drawn[:, ball] = (radii[ball] + cover * (inside - radii[ball])).min(axis=1)
    return drawn


def stacked(angles: Array, race: float, radii: tuple[float, ...]) -> Array:
    """Return the heights at which balls are drawn above the race, shape (rows, balls).

    A ball inside another would be invisible in space, so a ball that covers an earlier one is drawn
    on top of it. The arguments are those of `shrunk`.
    """
    heights = np.zeros(angles.shape)
    for ball in range(1, len(radii)):
        above = heights[:, :ball] + np.array(radii[:ball]) + radii[ball]
        heights[:, ball] = (_cover(angles, ball, race, radii[ball]) * above).max(axis=1)
    return heights


def _cover(angles: Array, ball: int, race: float, radius: float) -> Array:
    """Return the overlap with each earlier ball: 1 at the same place, 0 at a radius or more."""
    chord = 2.0 * race * np.abs(np.sin(0.5 * (angles[:, :ball] - angles[:, ball, None])))
    return np.asarray(np.clip(1.0 - chord / radius, 0.0, 1.0))

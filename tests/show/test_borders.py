"""Borders of regions that are known at points only."""

import numpy as np
from matplotlib.figure import Figure

from ab_sim.show.maps import smoothed


def border(values: np.ndarray) -> np.ndarray:
    """Its one line; shape (points, 2)."""
    (line,) = Figure().subplots().contour(values, levels=[0.5]).allsegs[0]
    return np.asarray(line)


def turning(line: np.ndarray) -> float:
    """By how much the direction changes along a line, all together [rad]."""
    steps = np.diff(line, axis=0)
    steps = steps[np.hypot(*steps.T) > 1e-9]
    return float(np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))).sum())


def test_a_straight_border_is_drawn_nearly_straight() -> None:
    up, across = np.mgrid[0:60, 0:60]
    inside = up > 0.3 * across + 10.2
    assert turning(border(smoothed(inside))) < 0.5 * turning(border(inside.astype(float)))


def test_no_point_changes_sides_and_no_island_is_lost() -> None:
    inside = np.random.default_rng(0).random((40, 40)) > 0.5
    assert ((smoothed(inside) > 0.5) == inside).all()
    island = np.zeros((20, 20), bool)
    island[9, 9] = True
    assert len(border(smoothed(island))) > 3

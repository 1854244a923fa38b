"""Overlaps of balls that have a radius but no contact: pairs of balls and first times.

Without the effect ``ball_contact`` balls pass through each other; their radius is used for spin and
friction only. A run with overlaps shows a motion that no real drive has.
"""

import math
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.equations.neighbours import APART, never_part, reduced, start_angles
from ab_sim.scene.model import Scene

WHAT_CHANGES = (
    "without the effect ball_contact balls pass through each other; with it "
    "(effects.ball_contact.restitution_coefficient) they collide and line up"
)


class Overlap(NamedTuple):
    """Pair of balls that overlapped during a run."""

    balls: tuple[int, int]
    """Numbers of the balls, the lower one first."""
    since: float
    """Time of the first overlap [s]."""


class OverlapAccumulator:
    """Detector of overlaps in successive samples.

    Two balls overlap if the chord between their centres on a round race is shorter than a_i + a_j.
    They have also overlapped if one has passed the other between two samples.

    Parameters
    ----------
    scene
        Scene of the samples.
    """

    def __init__(self, scene: Scene) -> None:
        balls, radius = scene.balls, scene.race.radius
        self.possible = False
        """True if balls can overlap: two or more of known radius in one race, and no contact."""
        if "ball_contact" in scene.effects:
            return
        pairs = [
            (i, j)
            for i, j in combinations(range(balls.count), 2)
            if balls.races[i] == balls.races[j] and not math.isnan(balls.radii[i] + balls.radii[j])
        ]
        self.possible = bool(pairs)
        self._pairs = np.array(pairs, dtype=int).reshape(-1, 2)
        sizes = np.array(balls.radii)[self._pairs].sum(axis=1)
        self._apart = 2.0 * np.arcsin(np.minimum(sizes / (2.0 * radius), 1.0))
        self._before: np.ndarray | None = None
        self._overlaps: list[Overlap] = []

    @property
    def overlaps(self) -> tuple[Overlap, ...] | None:
        """Return the first overlap of each pair so far, in order of time.

        Return None if balls cannot overlap.
        """
        return tuple(self._overlaps) if self.possible else None

    def take(self, block: Trajectory) -> None:
        """Process the next samples of a trajectory."""
        if len(block):
            self.look(block["time"], block.ball_angles)

    def look(self, time: np.ndarray, angles: np.ndarray) -> None:
        """Process the next samples.

        Parameters
        ----------
        time
            Times of at least one sample [s], shape (samples,).
        angles
            Ball angles, unwrapped [rad], shape (samples, balls).
        """
        if not self.possible or len(self._pairs) == 0:
            return
        between = angles[:, self._pairs[:, 1]] - angles[:, self._pairs[:, 0]]
        turns = np.floor(between / (2.0 * math.pi))
        within = between - 2.0 * math.pi * turns
        overlap = np.minimum(within, 2.0 * math.pi - within) < self._apart
        # The number of turns between two balls changes when one passes the other, even if no
        # sample shows them together.
        before = turns[:1] if self._before is None else self._before
        overlap |= np.diff(turns, axis=0, prepend=before) != 0.0
        self._before = turns[-1:]
        new = overlap.any(axis=0)
        if not new.any():
            return
        firsts = np.argmax(overlap, axis=0)
        for k in sorted(np.flatnonzero(new), key=lambda k: (firsts[k], k)):
            i, j = self._pairs[k].tolist()
            self._overlaps.append(Overlap((i, j), float(time[firsts[k]])))
        # Only the first overlap of each pair counts, so the pair is dropped.
        self._pairs, self._apart = self._pairs[~new], self._apart[~new]
        self._before = self._before[:, ~new]


def overlaps_at_start(scene: Scene) -> str:
    """Describe whether balls overlap at a scene's start; return an empty text if they never can."""
    record = OverlapAccumulator(scene)
    if not record.possible:
        return ""
    record.look(np.zeros(1), np.array([start_angles(scene)]))
    return overlaps_text(record.overlaps) if record.overlaps else "not at the start, but they can"


def together_at_start(scene: Scene) -> str:
    """Return a warning of equal balls that start at one angle; empty if there are none."""
    pairs = never_part(scene)
    if not pairs:
        return ""
    balls = sorted({ball for pair in pairs for ball in pair})
    apart = f"[{', '.join(f'{reduced(APART * ball)[0]:.3g}' for ball in range(scene.balls.count))}]"
    return (
        f"equal balls that start at one angle never part, and act as one ball: "
        f"balls {', '.join(map(str, balls))}; start them apart, "
        f"--set 'start.ball_angles={apart}'"
    )


def overlaps_text(overlaps: tuple[Overlap, ...] | None) -> str:
    """Describe the first overlap and the number of the others.

    Return a dash if balls cannot overlap.
    """
    if overlaps is None:
        return "-"
    if not overlaps:
        return "no"
    (i, j), since = overlaps[0]
    first = f"balls {i} and {j}, first at {since:.4g} s"
    more = len(overlaps) - 1
    return first if more == 0 else f"{first}; {more} more pair{'' if more == 1 else 's'}"

"""How far one run is from another, in the units in which an accuracy is asked for."""

from typing import NamedTuple

import numpy as np

from ab_sim.drive.trajectory import Trajectory

MOST_SAMPLES = 200_000
"""Of a run, for comparing; of a longer one fewer are kept than there are steps."""
ROUNDING = 8.0 * float(np.finfo(float).eps)
"""No number is known better than to some of its last digits, even where two runs agree on more."""


class Samples(NamedTuple):
    """What runs are compared by, at equally spaced times; the start is not among them."""

    position: np.ndarray
    """Deck displacement on inertial axes [m], shape (samples, 2), or 3 where it moves in space."""
    angles: np.ndarray
    """theta of each ball, unwrapped [rad], shape (samples, balls)."""

    @classmethod
    def of(cls, trajectory: Trajectory) -> "Samples":
        """All of a trajectory, copied: the rest of it need not be kept."""
        return cls(trajectory.position.copy(), trajectory.ball_angles.copy())

    def every(self, so_many: int) -> "Samples":
        """Each so-many-th, which is the last of every so many."""
        return Samples(self.position[so_many - 1 :: so_many], self.angles[so_many - 1 :: so_many])


class Deviation(NamedTuple):
    """Largest differences between a run and its reference, over the run and at its end."""

    angle: float
    """Of any ball's angle theta, over the run [rad]; 0 without balls."""
    whirl: float
    """Of the deck's displacement, a vector's length, over the run [units]; see ``deviation``."""
    angle_end: float
    """As ``angle``, at the last sample."""
    whirl_end: float
    """As ``whirl``, at the last sample."""


def deviation(run: Samples, reference: Samples, unit: float) -> Deviation:
    """Compare two runs at all times at which both have samples.

    Args:
        run, reference: samples of the same stretch of time, each equally spaced up to its end; one
            may have a whole multiple of the other's.
        unit: length in which the whirl's error is given [m]: the eccentricity e, or the race's
            radius for a rotor without unbalance.

    Raises:
        ValueError: there are no samples, neither number is a multiple of the other, or they are
            of different numbers of balls.
    """
    fewest, most = sorted([len(run.position), len(reference.position)])
    if not fewest or most % fewest or run.angles.shape[1] != reference.angles.shape[1]:
        shapes = [part.shape for part in (*run, *reference)]
        raise ValueError(f"samples of shapes {shapes} cannot be compared")
    run, reference = (each.every(len(each.position) // fewest) for each in (run, reference))
    whirl = np.linalg.norm(run.position - reference.position, axis=1) / unit
    angle = np.abs(run.angles - reference.angles).max(axis=1, initial=0.0)
    return Deviation(float(angle.max()), float(whirl.max()), float(angle[-1]), float(whirl[-1]))


def rounding(run: Samples, unit: float) -> Deviation:
    """The least that a run may be said to be off by; ``unit`` as of ``deviation``."""
    angle = ROUNDING * float(np.abs(run.angles).max(initial=0.0))
    whirl = ROUNDING * float(np.abs(run.position).max(initial=0.0)) / unit
    return Deviation(angle, whirl, angle, whirl)

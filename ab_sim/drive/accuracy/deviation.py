"""Differences between two runs, in the units of a requested accuracy."""

from typing import NamedTuple

import numpy as np

from ab_sim.drive.trajectory import Trajectory

MOST_SAMPLES = 200_000
"""Largest number of samples per run for a comparison; longer runs are decimated."""
ROUNDING = 8.0 * float(np.finfo(float).eps)
"""Least relative error of a number, due to rounding."""


class Samples(NamedTuple):
    """Samples of a run for comparison at equally spaced times, without the start."""

    position: np.ndarray
    """Displacement of the deck on inertial axes [m], shape (samples, 2), or (samples, 3) in
    space."""
    angles: np.ndarray
    """Angle theta of each ball, unwrapped [rad], shape (samples, balls)."""

    @classmethod
    def of(cls, trajectory: Trajectory) -> "Samples":
        """Return copies of a trajectory's samples, so that the rest can be released."""
        return cls(trajectory.position.copy(), trajectory.ball_angles.copy())

    def every(self, n: int) -> "Samples":
        """Return every ``n``-th sample, beginning with the ``n``-th."""
        return Samples(self.position[n - 1 :: n], self.angles[n - 1 :: n])


class Deviation(NamedTuple):
    """Largest differences between a run and its reference, over the run and at its end."""

    angle: float
    """Largest difference of a ball angle theta over the run [rad]; 0 without balls."""
    whirl: float
    """Largest length of the difference of displacements over the run, in ``deviation``'s unit."""
    angle_end: float
    """Difference of ball angles at the last sample [rad]."""
    whirl_end: float
    """Length of the difference of displacements at the last sample, in the same unit."""


def deviation(run: Samples, reference: Samples, unit: float) -> Deviation:
    """Compare two runs at their common times.

    Args:
        run, reference: samples of the same stretch of time, equally spaced up to its end. The
            number of samples of one is a multiple of that of the other.
        unit: length in which the whirl's error is given [m]: the eccentricity e, or the race's
            radius for a rotor without unbalance.

    Raises:
        ValueError: there are no samples, neither number of samples is a multiple of the other, or
            the numbers of balls differ.
    """
    fewest, most = sorted([len(run.position), len(reference.position)])
    if not fewest or most % fewest or run.angles.shape[1] != reference.angles.shape[1]:
        shapes = [part.shape for part in (*run, *reference)]
        raise ValueError(f"samples of shapes {shapes} cannot be compared")
    run, reference = (
        samples.every(len(samples.position) // fewest) for samples in (run, reference)
    )
    whirl = np.linalg.norm(run.position - reference.position, axis=1) / unit
    angle = np.abs(run.angles - reference.angles).max(axis=1, initial=0.0)
    return Deviation(float(angle.max()), float(whirl.max()), float(angle[-1]), float(whirl[-1]))


def rounding(run: Samples, unit: float) -> Deviation:
    """Return the error of a run by rounding alone; ``unit`` as for ``deviation``."""
    angle = ROUNDING * float(np.abs(run.angles).max(initial=0.0))
    whirl = ROUNDING * float(np.abs(run.position).max(initial=0.0)) / unit
    return Deviation(angle, whirl, angle, whirl)

"""How far one run is from another, in the units in which an accuracy is asked for."""

from typing import NamedTuple

import numpy as np


class Deviation(NamedTuple):
    """Largest differences between a run and its reference, over the run and at its end."""

    angle: float
    """Of any ball's angle theta, over the run [rad]; 0 without balls."""
    whirl: float
    """Of the deck's place, a vector's length, over the run [units]; see ``deviation``."""
    angle_end: float
    """As ``angle``, at the last sample."""
    whirl_end: float
    """As ``whirl``, at the last sample."""


def deviation(
    position: np.ndarray,
    angles: np.ndarray,
    reference_position: np.ndarray,
    reference_angles: np.ndarray,
    unit: float,
) -> Deviation:
    """Compare samples of two runs taken at the same times.

    Args:
        position: deck displacement on inertial axes [m], shape (samples, 2).
        angles: theta of each ball, unwrapped [rad], shape (samples, balls).
        reference_position, reference_angles: the same of the reference.
        unit: length in which the whirl's error is given [m]: the eccentricity e, or the race's
            radius for a rotor without unbalance.

    Raises:
        ValueError: shapes differ, or there are no samples.
    """
    if position.shape != reference_position.shape or angles.shape != reference_angles.shape:
        raise ValueError(
            f"samples of shapes {position.shape} and {angles.shape} cannot be compared with "
            f"{reference_position.shape} and {reference_angles.shape}"
        )
    if not len(position):
        raise ValueError("no samples to compare")
    whirl = np.hypot(*(position - reference_position).T) / unit
    angle = np.abs(angles - reference_angles).max(axis=1, initial=0.0)
    return Deviation(float(angle.max()), float(whirl.max()), float(angle[-1]), float(whirl[-1]))


ROUNDING = 8.0 * float(np.finfo(float).eps)
"""No number is known better than to some of its last digits, even where two runs agree on more."""


def rounding(position: np.ndarray, angles: np.ndarray, unit: float) -> Deviation:
    """The least that a run may be said to be off by; arguments as of ``deviation``."""
    angle = ROUNDING * float(np.abs(angles).max(initial=0.0))
    whirl = ROUNDING * float(np.abs(position).max(initial=0.0)) / unit
    return Deviation(angle, whirl, angle, whirl)

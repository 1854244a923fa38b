"""When runs are compared, and what of them."""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.errors import InputError
from ab_sim.scene.model import Scene

LADDER = (0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 2.5e-3, 5e-3, 10e-3)
"""Steps that every stepper is tried at [s]; all divide the longest."""
LEAST_SAMPLES = 20


class Samples(NamedTuple):
    """A run at the sample times."""

    position: np.ndarray
    """Deck displacement on inertial axes [m], shape (samples, 2)."""
    angles: np.ndarray
    """Ball angles theta, unwrapped [rad], shape (samples, balls)."""


class Sampling(NamedTuple):
    """Sample times: whole multiples of a period, so that every run has a step that ends there."""

    period: float
    """s."""
    number: int

    @property
    def times(self) -> np.ndarray:
        """s, shape (number,); the start, where all runs agree, is not among them."""
        return np.arange(1, self.number + 1) * self.period

    @property
    def end(self) -> float:
        """The last of them [s]."""
        return self.number * self.period

    def per_period(self, step: float) -> int:
        """How many steps make a period; 0 if it is not a whole number."""
        period, one = nanoseconds(self.period), nanoseconds(step)
        return period // one if period % one == 0 else 0


def sampling_of(scene: Scene) -> Sampling:
    """The common sample times of a scene.

    The period is the ladder's longest step, or the least multiple of it that the scene's own step
    divides, if that leaves enough samples; a shorter step of the ladder for a short scene. Where
    the duration is not a multiple of it, the comparison ends at the last one before.

    Raises:
        InputError: the duration is too short to compare anything.
    """
    duration = nanoseconds(scene.duration)
    longest, own = nanoseconds(LADDER[-1]), nanoseconds(scene.solver.step)
    wished = [math.lcm(longest, own)] + [nanoseconds(step) for step in reversed(LADDER)]
    for period in wished:
        if duration // period >= LEAST_SAMPLES:
            return Sampling(period / 1e9, duration // period)
    least = LEAST_SAMPLES * LADDER[0]
    raise InputError(
        f"duration = {scene.duration:g} s: too short to compare steppers in; give at least "
        f"{least:g} s, e.g. --set duration={least:g}"
    )


def nanoseconds(time: float) -> int:
    """The nearest whole number of nanoseconds: steps are compared exactly, not as floats."""
    return round(time * 1e9)

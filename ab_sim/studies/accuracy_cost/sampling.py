"""When runs are compared."""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.accuracy.deviation import MOST_SAMPLES
from ab_sim.errors import InputError
from ab_sim.scene.model import Scene

LADDER = (0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 2.5e-3, 5e-3, 10e-3)
"""Steps that every stepper is tried at [s]; all divide the longest."""
LEAST_SAMPLES = 20
DENSE = 0.5e-3
"""Steps that are not shorter are compared at the end of each of them [s]: just after a jump of the
spindle's acceleration, errors of long steps peak for some milliseconds."""


class SampleTimes(NamedTuple):
    """Sample times: whole multiples of a period, so that every run has a step that ends there."""

    period: float
    """s."""
    number: int
    parts: int = 1
    """The reference has samples at so many parts of each period; steppers, at those of them at
    which a step ends."""

    @property
    def times(self) -> np.ndarray:
        """s, shape (number,); the start, where all runs agree, is not among them."""
        return np.arange(1, self.number + 1) * self.period

    @property
    def end(self) -> float:
        """The last of them [s]."""
        return self.number * self.period

    @property
    def finest(self) -> "SampleTimes":
        """The reference's: a sample at each of the parts."""
        return SampleTimes(self.period / self.parts, self.number * self.parts)

    def per_period(self, step: float) -> int:
        """How many steps make a period; 0 if it is not a whole number."""
        period, one = nanoseconds(self.period), nanoseconds(step)
        return period // one if period % one == 0 else 0


def sampling_of(scene: Scene) -> SampleTimes:
    """The common sample times of a scene.

    The period is the ladder's longest step, or the least multiple of it that the scene's own step
    divides, if that leaves enough samples; a shorter step of the ladder for a short scene. Its
    parts are such that all steps down to ``DENSE``, of the ladder and the scene's own, end at one,
    as long as that does not make too many. Where the duration is not a multiple of the period, the
    comparison ends at the last one before.

    Raises:
        InputError: the duration is too short to compare anything.
    """
    duration = nanoseconds(scene.duration)
    longest, own = nanoseconds(LADDER[-1]), nanoseconds(scene.solver.step)
    wished = [math.lcm(longest, own)] + [nanoseconds(step) for step in reversed(LADDER)]
    for period in wished:
        if duration // period >= LEAST_SAMPLES:
            found = SampleTimes(period / 1e9, duration // period)
            return found._replace(parts=_parts(found, [scene.solver.step, *reversed(LADDER)]))
    least = LEAST_SAMPLES * LADDER[0]
    raise InputError(
        f"duration = {scene.duration:g} s: too short to compare steppers in; give at least "
        f"{least:g} s, e.g. --set duration={least:g}"
    )


def _parts(sampling: SampleTimes, steps: list[float]) -> int:
    parts = 1
    for step in steps:
        each = sampling.per_period(step)
        if each and step >= DENSE and sampling.number * math.lcm(parts, each) <= MOST_SAMPLES:
            parts = math.lcm(parts, each)
    return parts


def nanoseconds(time: float) -> int:
    """The nearest whole number of nanoseconds: steps are compared exactly, not as floats."""
    return round(time * 1e9)

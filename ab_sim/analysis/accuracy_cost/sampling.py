"""Times at which runs are compared."""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import InputError
from ab_sim.drive.accuracy.deviation import MOST_SAMPLES
from ab_sim.scene.model import Scene

LADDER = (0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 2.5e-3, 5e-3, 10e-3)
"""Steps at which every stepper is measured [s]; all divide the longest."""
LEAST_SAMPLES = 20
DENSE = 0.5e-3
"""Shortest step [s] for which runs are compared at the end of every step. Just after a jump of the
spindle's acceleration, errors of long steps peak for some milliseconds."""


class SampleTimes(NamedTuple):
    """Sample times at whole multiples of a period, at which steps of all runs end."""

    period: float
    """Period [s]."""
    number: int
    parts: int = 1
    """Number of reference samples per period; runs are compared at those where a step ends."""

    @property
    def times(self) -> np.ndarray:
        """Times [s], shape (number,), without the start, where all runs agree."""
        return np.arange(1, self.number + 1) * self.period

    @property
    def end(self) -> float:
        """Last sample time [s]."""
        return self.number * self.period

    @property
    def finest(self) -> "SampleTimes":
        """Sample times of the reference, ``parts`` in each period."""
        return SampleTimes(self.period / self.parts, self.number * self.parts)

    def per_period(self, step: float) -> int:
        """Return the number of steps per period; 0 if it is not whole."""
        period, one = nanoseconds(self.period), nanoseconds(step)
        return period // one if period % one == 0 else 0


def sampling_of(scene: Scene) -> SampleTimes:
    """Return the common sample times of a scene.

    The period is the smallest multiple of the ladder's longest step that the scene's step divides,
    or that longest step itself if too few samples would remain. A short scene uses a shorter step
    of the ladder. All steps down to ``DENSE``, of the ladder and of the scene, end at one of the
    period's parts, unless that needs too many parts. If the duration is not a multiple of the
    period, the comparison ends at the last whole period.

    Raises:
        InputError: the duration is too short to compare anything.
    """
    duration = nanoseconds(scene.duration)
    longest, scene_step = nanoseconds(LADDER[-1]), nanoseconds(scene.solver.step)
    wished = [math.lcm(longest, scene_step)] + [nanoseconds(step) for step in reversed(LADDER)]
    for period in wished:
        if duration // period >= LEAST_SAMPLES:
            times = SampleTimes(period / 1e9, duration // period)
            return times._replace(parts=_parts(times, [scene.solver.step, *reversed(LADDER)]))
    least = LEAST_SAMPLES * LADDER[0]
    raise InputError(
        f"duration = {scene.duration:g} s: too short to compare steppers in; give at least "
        f"{least:g} s, e.g. --set duration={least:g}"
    )


def _parts(sampling: SampleTimes, steps: list[float]) -> int:
    parts = 1
    for step in steps:
        per_period = sampling.per_period(step)
        if (
            per_period
            and step >= DENSE
            and sampling.number * math.lcm(parts, per_period) <= MOST_SAMPLES
        ):
            parts = math.lcm(parts, per_period)
    return parts


def nanoseconds(time: float) -> int:
    """Return the nearest whole number of nanoseconds, for exact comparison of steps."""
    return round(time * 1e9)

"""A recording as the fit sees it: vibration at some times, and how the spindle turned."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ab_sim.scene.sensors import Sampled
from ab_sim.spindle import SpeedSchedule

DISPLACEMENT, ACCELERATION = "displacement", "acceleration"
UNITS = {DISPLACEMENT: "m", ACCELERATION: "m/s^2"}
"""What a signal is of, and its unit."""
GAIN, BIAS, DELAY, DISC_ANGLE = "gain", "bias", "delay", "disc_angle"
NUISANCES = (GAIN, BIAS, DELAY, DISC_ANGLE)
"""What a recording may have of its own beside the start of its run: factor and offset of the
signals, by how much they are late [s], and the angle of the disc at the start [rad]."""


@dataclass(frozen=True)
class Measured:
    """One recording, in SI units, its time counted from its first sample."""

    name: str
    time: np.ndarray
    """Of the samples [s], rising, above 0; shape (samples,)."""
    signals: np.ndarray
    """Along each axis [m or m/s^2], NaN where there is none; shape (samples, axes)."""
    axes: tuple[float, ...]
    """Direction of each axis, from the deck's x [rad]."""
    kind: str
    """``DISPLACEMENT`` or ``ACCELERATION``."""
    schedule: SpeedSchedule
    """How the spindle turned."""
    angle_known: bool
    """Whether its angle was recorded, and not its speed alone."""
    with_balls: bool
    sensor: Sampled | None = None
    """Whose low-pass the signals went through; None: through none."""
    step: float | None = None
    """Integration step of the run that was recorded [s]; None of a real drive's."""
    delay: float = 0.0
    """By which the signals are known to be late [s]."""
    free: tuple[str, ...] = ()
    """Which of ``NUISANCES`` are not known."""
    at_rest: bool = True
    """Whether deck and balls were at rest when it began."""
    trial_mass: float = 0.0
    """Clamped to the deck for this recording [kg]."""
    doubt: str = ""
    """Reason to refuse it if the fit does not explain it, see ``check_sense``; empty of most."""
    notes: tuple[str, ...] = field(default=())
    """What has to be said of it."""

    @property
    def unit(self) -> str:
        """Of the signals."""
        return UNITS[self.kind]

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    @cached_property
    def spindle_angle(self) -> np.ndarray:
        """At each sample [rad]; asked for in each look at what a fit leaves."""
        return self.schedule.angles(self.time)

    @property
    def count(self) -> int:
        """Of numbers that were measured."""
        return int(np.isfinite(self.signals).sum())

    @property
    def rms(self) -> float:
        """Of the signals about their mean."""
        return float(np.sqrt(np.nanmean((self.signals - np.nanmean(self.signals, axis=0)) ** 2)))

    def until(self, time: float) -> "Measured":
        """Its beginning."""
        some = max(int(np.searchsorted(self.time, time, "right")), 8)
        return replace(self, time=self.time[:some], signals=self.signals[:some])

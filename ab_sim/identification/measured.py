"""Recording as used by the fit: vibration at given times, and motion of the spindle."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.sensors import Sampled

DISPLACEMENT, ACCELERATION = "displacement", "acceleration"
UNITS = {DISPLACEMENT: "m", ACCELERATION: "m/s^2"}
"""SI unit of each quantity that a vibration signal can be."""
GAIN, BIAS, DELAY, DISC_ANGLE = "gain", "bias", "delay", "disc_angle"
NUISANCES = (GAIN, BIAS, DELAY, DISC_ANGLE)
"""Names of parameters that belong to one recording, in addition to its initial state.

Factor and offset of the signals, their delay [s], and the angle of the disc at the start [rad].
"""


@dataclass(frozen=True)
class Measured:
    """Recording in SI units."""

    name: str
    time: np.ndarray
    """Times of the samples [s], rising, above 0, shape (samples,)."""
    signals: np.ndarray
    """Signals along each axis [m or m/s^2], NaN if missing, shape (samples, axes)."""
    axes: tuple[float, ...]
    """Direction of each axis, from the deck's x [rad]."""
    kind: str
    """Kind of the signals: ``DISPLACEMENT`` or ``ACCELERATION``."""
    schedule: SpeedSchedule
    """Recorded motion of the spindle."""
    angle_known: bool
    """True if the angle was recorded; otherwise only the speed was."""
    with_balls: bool
    sensor: Sampled | None = None
    """Sensor whose low-pass the signals passed; None if there was none."""
    step: float | None = None
    """Integration step of a recorded simulation [s]; None for a real drive."""
    delay: float = 0.0
    """Known delay of the signals [s]."""
    free: tuple[str, ...] = ()
    """Names in ``NUISANCES`` that are unknown."""
    at_rest: bool = True
    """True if deck and balls are at rest at the start."""
    trial_mass: float = 0.0
    """Mass clamped to the deck for this recording [kg]."""
    doubt: str = ""
    """Reason to refuse the recording if the fit does not explain it, see ``check_sense``; else
    empty."""
    notes: tuple[str, ...] = field(default=())
    """Notes for the user."""

    @property
    def unit(self) -> str:
        """Unit of the signals."""
        return UNITS[self.kind]

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    @cached_property
    def spindle_angle(self) -> np.ndarray:
        """Spindle angle at each sample [rad]; cached for repeated evaluations of residuals."""
        return self.schedule.angles(self.time)

    @property
    def count(self) -> int:
        """Number of measured values."""
        return int(np.isfinite(self.signals).sum())

    @property
    def rms(self) -> float:
        """Root mean square of the signals about their mean [m or m/s^2]."""
        return float(np.sqrt(np.nanmean((self.signals - np.nanmean(self.signals, axis=0)) ** 2)))

    def until(self, time: float) -> "Measured":
        """Return the beginning of the recording, up to a time [s] but at least 8 samples."""
        some = max(int(np.searchsorted(self.time, time, "right")), 8)
        return replace(self, time=self.time[:some], signals=self.signals[:some])

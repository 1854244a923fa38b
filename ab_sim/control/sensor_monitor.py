"""Plausibility checks of a sensor, which may abort a start-up."""

import enum
import math

from ab_sim.control import chosen

TURN = 6.283185307179586


class Reason(enum.IntEnum):
    """Reason for an abort; the C version has the same numbers."""

    NONE = 0
    ASKED = 1
    SILENT = 2
    TIME_BACK = 3
    LIMIT = 4
    REPEATING = 5
    DRIFTING = 6
    AXES = 7
    ANGLE = 8
    NOT_FOLLOWING = 9


TEXTS = {
    Reason.ASKED: "asked to",
    Reason.SILENT: "no good sample for too long: sensor or spindle angle dropped out",
    Reason.TIME_BACK: "the sensor's time went back: the drive was reset",
    Reason.LIMIT: "a reading beyond the limit",
    Reason.REPEATING: "the sensor reads the same again and again: it is stuck or saturated",
    Reason.DRIFTING: "the sensor's offset drifts away",
    Reason.AXES: "the two axes contradict each other: one has the wrong sign or is turned, or the "
    "spindle turns the other way",
    Reason.ANGLE: "the spindle's angle does not go on with its speed: wrong sign, or slipped",
    Reason.NOT_FOLLOWING: "the spindle does not follow: caught at the critical speed, or no torque",
}


class SensorMonitor:
    """Monitor of the readings of a sensor with one or two axes.

    Parameters
    ----------
    axes : int
        Number of axes, 1 or 2.
    unit : float
        Unit of time in which the constants of ``chosen`` are given [s].
    limit : float
        Largest magnitude of a valid reading [m or m/s^2].
    """

    __slots__ = (
        "_axes", "_last", "_limit", "_mean", "_origin", "_peak", "_run", "_swing", "_unit",
        "agreement", "doubt", "slip", "stuck",
    )  # fmt: skip

    def __init__(self, axes: int, unit: float, limit: float) -> None:
        self._axes, self._unit, self._limit = axes, unit, limit
        self._last, self._peak, self._run = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self._mean, self._origin, self._swing = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.stuck = [0.0, 0.0]
        """Time with repeated readings on each axis [s]."""
        self.agreement = 1.0
        """Averaged agreement of the axes on the net unbalance: 1 equal, 0 perpendicular, -1
        opposite."""
        self.doubt = 0.0
        """Remaining time in which another contradiction of the axes causes an abort [s]."""
        self.slip = 0.0
        """Fraction of recent samples whose angle contradicts the speed."""

    def readings(
        self, readings: tuple[float, float], dt: float, turning: bool, first: bool
    ) -> Reason:
        """Check the readings of a sample.

        Parameters
        ----------
        readings : tuple of float
            Readings along both axes [m or m/s^2].
        dt : float
            Time since the last sample [s].
        turning : bool
            Whether the spindle is fast enough for checks of the signal's shape.
        first : bool
            Whether there is no earlier sample to compare with.

        Returns
        -------
        Reason
            Reason for an abort; ``NONE`` if there is none.
        """
        for i in range(self._axes):
            reading = readings[i]
            size = abs(reading)
            if size > self._limit:
                return Reason.LIMIT
            self._peak[i] = max(self._peak[i], size)
            if reading == self._last[i]:
                self._run[i] += 1.0
            else:
                self._run[i] = 0.0
            self._last[i] = reading
            if self._run[i] >= chosen.REPEATS and turning and size >= 0.5 * self._peak[i]:
                self.stuck[i] += dt
            else:
                self.stuck[i] = max(self.stuck[i] - 0.1 * dt, 0.0)
            if self.stuck[i] > chosen.REPEATED * self._unit:
                return Reason.REPEATING
            if first:
                self._mean[i] = self._origin[i] = reading
            self._mean[i] += (reading - self._mean[i]) * (dt / (dt + chosen.MEAN * self._unit))
            self._swing[i] = max(self._swing[i], abs(reading - self._mean[i]))
            drifted = abs(self._mean[i] - self._origin[i])
            if turning and drifted > chosen.DRIFTED * self._swing[i]:
                return Reason.DRIFTING
        return Reason.NONE

    def angle(self, change: float, expected: float) -> Reason:
        """Check a change of the spindle's angle against the change from its speed [rad]."""
        if abs(expected) > 1.0:
            return Reason.NONE
        off = change - expected
        off -= TURN * math.floor(off / TURN + 0.5)
        slipped = 1.0 if abs(off) > chosen.CONTRADICTING * max(abs(expected), 0.1) else 0.0
        self.slip += (slipped - self.slip) * 0.02
        return Reason.ANGLE if self.slip > 0.5 else Reason.NONE

    def axes(self, likeness: float, dt: float) -> tuple[bool, Reason]:
        """Check the agreement of both axes: 1 equal, 0 perpendicular, -1 opposite.

        Returns
        -------
        bool
            Whether they contradict each other for the first time; then both filters should restart.
            One of them may have failed to follow a net unbalance that turned fast.
        Reason
            Reason for an abort if they contradict each other again after a restart, else ``NONE``.
        """
        time = chosen.AXES_AVERAGE * self._unit
        self.agreement += (likeness - self.agreement) * (dt / (dt + time))
        self.doubt = max(self.doubt - dt, 0.0)
        if self.agreement >= chosen.AGREEING:
            return False, Reason.NONE
        if self.doubt > 0.0:
            return False, Reason.AXES
        self.agreement, self.doubt = 1.0, chosen.DOUBT * self._unit
        return True, Reason.NONE

    def numbers(self) -> list[float]:
        """Return the state, for ``restore``."""
        state = [*self._last, *self._peak, *self._run, *self._mean, *self._origin, *self._swing]
        return [*state, *self.stuck, self.agreement, self.slip, self.doubt]

    def restore(self, numbers: list[float]) -> None:
        """Restore a state that ``numbers`` returned."""
        self._last, self._peak, self._run = numbers[0:2], numbers[2:4], numbers[4:6]
        self._mean, self._origin, self._swing = numbers[6:8], numbers[8:10], numbers[10:12]
        self.stuck, (self.agreement, self.slip, self.doubt) = numbers[12:14], numbers[14:]

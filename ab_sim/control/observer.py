"""Estimation of critical speed, damping and net unbalance from readings; checks of the sensor."""

import enum
import math

from ab_sim.control import chosen
from ab_sim.control.axis_filter import NUMBERS, AxisFilter
from ab_sim.control.settings import StartUpSettings

TURN = 6.283185307179586
"""One turn [rad]."""


class Reason(enum.IntEnum):
    """Reason for an abort; the C version has the same numbers."""

    NONE = 0
    REQUESTED = 1
    SILENT = 2
    TIME_BACK = 3
    LIMIT = 4
    REPEATING = 5
    DRIFTING = 6
    AXES = 7
    ANGLE = 8
    NOT_FOLLOWING = 9


TEXTS = {
    Reason.REQUESTED: "requested",
    Reason.SILENT: "no valid sample for too long: sensor or spindle angle dropped out",
    Reason.TIME_BACK: "the sensor's time went back: the drive was reset",
    Reason.LIMIT: "a reading beyond the limit",
    Reason.REPEATING: "the sensor repeats one reading: it is stuck or saturated",
    Reason.DRIFTING: "the sensor's offset drifts away",
    Reason.AXES: "the two axes contradict each other: one has the wrong sign or is turned, or the "
    "spindle turns the other way",
    Reason.ANGLE: "the spindle's angle contradicts its speed: wrong sign, or slipped",
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
        """Check the change of the spindle's angle between two samples.

        Parameters
        ----------
        change : float
            Change of the reported angle [rad], with or without whole turns.
        expected : float
            Change computed from the reported speeds [rad]; above 1 rad there is no check.

        Returns
        -------
        Reason
            ``ANGLE`` if most of the recent samples contradict the speed, else ``NONE``.
        """
        if abs(expected) > 1.0:
            return Reason.NONE
        off = change - expected
        off -= TURN * math.floor(off / TURN + 0.5)
        slipped = 1.0 if abs(off) > chosen.CONTRADICTING * max(abs(expected), 0.1) else 0.0
        self.slip += (slipped - self.slip) * 0.02
        return Reason.ANGLE if self.slip > 0.5 else Reason.NONE

    def axes(self, likeness: float, dt: float) -> tuple[bool, Reason]:
        """Check whether both axes agree on the net unbalance.

        Parameters
        ----------
        likeness : float
            Agreement at this sample: 1 equal, 0 perpendicular, -1 opposite net unbalances.
        dt : float
            Time since the last sample [s].

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
        """Return the complete state as 17 numbers, for ``restore``."""
        state = [*self._last, *self._peak, *self._run, *self._mean, *self._origin, *self._swing]
        return [*state, *self.stuck, self.agreement, self.slip, self.doubt]

    def restore(self, numbers: list[float]) -> None:
        """Restore a state that ``numbers`` returned."""
        self._last, self._peak, self._run = numbers[0:2], numbers[2:4], numbers[4:6]
        self._mean, self._origin, self._swing = numbers[6:8], numbers[8:10], numbers[10:12]
        self.stuck, (self.agreement, self.slip, self.doubt) = numbers[12:14], numbers[14:]


LARGEST = 1e9
"""Sum of the magnitudes of a sample's values above which the sample is invalid."""


class Observer:
    """Estimator of critical speed, damping and net unbalance: one filter per axis, averaged.

    Axes may differ in stiffness, so each has its own critical speed. The net unbalance is the same
    for both; if the filters disagree on it, an axis is wrong.

    Parameters
    ----------
    settings : StartUpSettings
        Checked settings.
    """

    __slots__ = (
        "_angle", "_axes", "_p", "_r", "_settings", "_slope", "_unit", "_monitor",
        "average_im", "average_re", "critical", "critical_deviation", "damping", "deviation",
        "fast", "im", "known", "re", "samples", "scale", "slow", "speed", "time",
    )  # fmt: skip

    def __init__(self, settings: StartUpSettings) -> None:
        sensing = settings.sensing
        self._settings = settings
        self._unit = chosen.UNIT / settings.final_speed
        acceleration = sensing.quantity == "acceleration"
        self._axes = [
            AxisFilter(acceleration, settings.final_speed, sensing.noise)
            for _ in range(sensing.axes)
        ]
        self._monitor = SensorMonitor(sensing.axes, self._unit, settings.limit)
        self.samples = 0.0
        """Number of valid samples."""
        self.time = self._angle = self.speed = self._slope = 0.0
        self._p = self._r = 0.0
        """Force per mass along the first axis for q = 1 m and q = 1 m times i (complex) [m/s^2]."""
        self.re = self.im = self.deviation = 0.0
        """Net unbalance, real and imaginary part, and its standard deviation [m]."""
        self.fast = self.slow = self.average_re = self.average_im = self.scale = 0.0
        """Fast and slow average of the net unbalance's magnitude; average of the complex net
        unbalance; and largest average magnitude [m]."""
        self.critical = self.critical_deviation = self.damping = 0.0
        """Critical speed and its standard deviation [rad/s], and damping [1/s]."""
        self.known = 0.0
        """1 once each axis has an estimate of net unbalance and suspension, else 0."""

    @property
    def rate(self) -> float:
        """Relative rate of change of the net unbalance's magnitude, per unit of time."""
        return (self.fast - self.slow) / ((chosen.SLOW - chosen.FAST) * (self.slow + 1e-30))

    @property
    def doubt(self) -> float:
        """Remaining time in which another contradiction of the axes causes an abort [s]."""
        return self._monitor.doubt

    @property
    def circulating(self) -> bool:
        """True if the net unbalance turns relative to the rotor: balls circulate."""
        square = self.average_re * self.average_re + self.average_im * self.average_im
        certain = self.deviation < chosen.CERTAIN * self.slow
        return certain and math.sqrt(square) < chosen.CIRCULATING * self.slow

    def take(
        self, time: float, angle: float, speed: float, first: float, second: float
    ) -> tuple[bool, Reason]:
        """Process a sample; see `StartUp.sample` for the arguments.

        Returns
        -------
        bool
            Whether the sample was valid.
        Reason
            Reason for an abort; ``NONE`` if there is none.
        """
        # NaN and infinity fail this comparison.
        readings = abs(angle) + abs(speed) + abs(first) + abs(second)
        if not (abs(time) < LARGEST and readings < LARGEST):
            return False, Reason.NONE
        settings = self._settings
        axis_angle = angle - settings.sensing.axis_angle
        c, s, square = math.cos(axis_angle), math.sin(axis_angle), speed * speed
        dt = time - self.time
        if self.samples == 0.0:
            self._take_over(time, angle, speed, square * c, -(square * s))
            return True, Reason.NONE
        if dt <= 0.0:
            back = Reason.TIME_BACK if dt < -chosen.BACK else Reason.NONE
            if back:
                self.speed = speed
            return False, back
        turning = speed >= 0.3 * settings.final_speed
        wrong = self._monitor.readings((first, second), dt, turning, self.samples == 1.0)
        if not wrong:
            expected = 0.5 * (speed + self.speed) * dt
            wrong = self._monitor.angle(angle - self._angle, expected)
        if wrong:
            return True, wrong
        slope = (speed - self.speed) / dt
        self._slope += (slope - self._slope) * (dt / (dt + 0.01 * self._unit))
        slope = self._slope
        p, r = square * c + slope * s, slope * c - square * s
        if dt > chosen.LONGEST_GAP * self._unit:
            for axis in self._axes:
                axis.restart()
        self._filter(dt, axis_angle, speed, p, r, first, second)
        self._take_over(time, angle, speed, p, r)
        return True, self._combine(dt)

    def _take_over(self, time: float, angle: float, speed: float, p: float, r: float) -> None:
        """Store the latest sample; ``p``, ``r``: values of ``_p``, ``_r`` at its time."""
        self.samples += 1.0
        self.time, self._angle, self.speed = time, angle, speed
        self._p, self._r = p, r

    def _filter(
        self, dt: float, angle: float, speed: float, p: float, r: float, first: float, second: float
    ) -> None:
        """Predict the filters' states over the time ``dt`` [s], and update them with readings.

        Steps are short enough that the force turns by at most ``STEP_ANGLE``: Heun's method of the
        filter needs that. Angle and speed within ``dt`` follow from a constant acceleration.
        """
        fastest = max(self._settings.final_speed, speed)
        parts = 1 + int(dt * fastest / chosen.STEP_ANGLE)
        h, slope = dt / parts, self._slope
        p0, r0 = self._p, self._r
        axes = self._axes
        for k in range(1, parts + 1):
            p1, r1 = p, r
            if k < parts:
                rest = (parts - k) * h
                w, then = speed - slope * rest, angle - rest * (speed - 0.5 * slope * rest)
                c, s, square = math.cos(then), math.sin(then), w * w
                p1, r1 = square * c + slope * s, slope * c - square * s
            if axes[0].known == 1.0:
                axes[0].predict(h, p0, r0, p1, r1)
            # The second axis is 90 degrees ahead, so angles from it are 90 degrees smaller.
            if len(axes) == 2 and axes[1].known == 1.0:
                axes[1].predict(h, -r0, p0, -r1, p1)
            p0, r0 = p1, r1
        if axes[0].known == 1.0:
            axes[0].update(first, p, r)
        else:
            axes[0].collect(first, speed)
        if len(axes) == 2:
            if axes[1].known == 1.0:
                axes[1].update(second, -r, p)
            else:
                axes[1].collect(second, speed)

    def _combine(self, dt: float) -> Reason:
        """Average the estimates of the axes over ``dt`` [s], weighted by their inverse variances.

        Return a reason for an abort; ``NONE`` if there is none.
        """
        weight = re = im = stiff_weight = stiffness = damping = count = 0.0
        for axis in self._axes:
            if axis.known == 1.0:
                state, P = axis.state, axis.covariance
                weight_here = 1.0 / (P[2][2] + P[3][3] + 1e-30)
                weight, re, im = (
                    weight + weight_here,
                    re + weight_here * state[2],
                    im + weight_here * state[3],
                )
                weight_here = 1.0 / (P[4][4] + 1e-20)
                stiff_weight, stiffness = (
                    stiff_weight + weight_here,
                    stiffness + weight_here * state[4],
                )
                damping, count = damping + state[5], count + 1.0
        self.known = 1.0 if count == len(self._axes) else 0.0
        if self.known == 0.0:
            return Reason.NONE
        self.re, self.im, self.deviation = re / weight, im / weight, math.sqrt(1.0 / weight)
        self.critical, self.damping = math.sqrt(stiffness / stiff_weight), damping / count
        self.critical_deviation = 0.5 * math.sqrt(1.0 / stiff_weight) / self.critical
        size = math.sqrt(self.re * self.re + self.im * self.im)
        # Two low-passes of |q| have different time constants, so that their difference gives the
        # rate of |q|. If balls circulate, q turns, and the low-pass of q itself becomes small.
        slow = dt / (dt + chosen.SLOW * self._unit)
        self.fast += (size - self.fast) * (dt / (dt + chosen.FAST * self._unit))
        self.slow += (size - self.slow) * slow
        self.average_re += (self.re - self.average_re) * slow
        self.average_im += (self.im - self.average_im) * slow
        # All decisions use |q| relative to its largest value, so that the sensor's gain cancels.
        certain = self.critical_deviation < chosen.KNOWN_CRITICAL * self.critical
        if certain and self.deviation < chosen.CERTAIN * size and self.fast > self.scale:
            self.scale = self.fast
        return self._compare(dt)

    def _compare(self, dt: float) -> Reason:
        """Compare the net unbalances of two axes; return a reason for an abort if they disagree."""
        if len(self._axes) == 1:
            return Reason.NONE
        (first, second) = self._axes
        a, b, c, d = first.state[2], first.state[3], second.state[2], second.state[3]
        one, other = a * a + b * b, c * c + d * d
        P, Q = first.covariance, second.covariance
        variance = P[2][2] + P[3][3] + Q[2][2] + Q[3][3]
        if variance < chosen.CERTAIN * chosen.CERTAIN * (one + other):
            restarts, wrong = self._monitor.axes(2.0 * (a * c + b * d) / (one + other), dt)
            if restarts:
                for axis in self._axes:
                    axis.restart_with(self.critical, self.damping)
            return wrong
        return Reason.NONE

    def numbers(self) -> list[float]:
        """Return the complete state: 36 numbers, and ``NUMBERS`` for each axis."""
        state = [self.samples, self.time, self._angle, self.speed, self._slope, self._p, self._r]
        state += [self.re, self.im, self.deviation, self.fast, self.slow, self.average_re]
        state += [self.average_im, self.scale, self.critical, self.critical_deviation]
        state += [self.damping, self.known, *self._monitor.numbers()]
        for axis in self._axes:
            state += axis.numbers()
        return state

    def restore(self, numbers: list[float]) -> None:
        """Restore a state that ``numbers`` returned."""
        self.samples, self.time, self._angle, self.speed, self._slope = numbers[:5]
        self._p, self._r = numbers[5:7]
        self.re, self.im, self.deviation, self.fast, self.slow, self.average_re = numbers[7:13]
        self.average_im, self.scale, self.critical, self.critical_deviation = numbers[13:17]
        self.damping, self.known = numbers[17:19]
        self._monitor.restore(numbers[19:36])
        for i, axis in enumerate(self._axes):
            axis.restore(numbers[36 + i * NUMBERS : 36 + (i + 1) * NUMBERS])

"""Broad-band vibration velocity of the deck, as used by ISO 20816-1.

It is the reading of an ideal instrument fixed to the deck at a sensor's position: the velocity
along each of the sensor's axes, through a high-pass of 10 Hz and a low-pass of 1000 Hz. The
standard defines the quantity and the band. The filters, fourth-order Butterworth, are chosen here.
"""

import math
from functools import lru_cache

import numpy as np

from ab_sim.analysis.metrics.judging import EachRun, JudgedRuns
from ab_sim.base.ordered_sum import ordered_dot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.engine.compiling import Cube, Table, compiled

LOWEST, HIGHEST = 10.0, 1000.0
"""Cut-off frequencies [Hz], at which the filters are 3 dB down (ISO 20816-1)."""
ORDER = 4
"""Order of each filter."""
_WIDEST = 0.01
"""Largest spacing of samples [s] that resolves the lower end of the band."""
TURN = 0.5 * math.pi
"""Largest spacing of samples as a spindle angle [rad] that resolves once-per-turn vibration."""

_RESTARTS, _RESTARTS_PER_SAMPLE = 2, 0.01
"""Limit of filter restarts: a fixed number, plus this fraction of the samples.

The filters forget the past at each restart. With more of them, too little would pass.
"""


class BandPass:
    """Band-pass filter of velocities from 10 to 1000 Hz, fed sample by sample.

    It starts in the steady state of the first sample, and restarts when the spacing of samples
    changes. If half the sample rate is at most 1000 Hz, there is no low-pass.
    """

    def __init__(self) -> None:
        self._step, self._time, self._before = math.nan, math.nan, np.empty(0)
        self._spacing, self._duration = -1, math.nan
        self.restarts: list[int] = []
        """Indices of the newest samples at which the filter restarted."""
        self._sections, self._state = np.empty((0, 5)), np.empty((0, 2, 0))

    def passed(self, steps: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return the filtered values of the next samples, at least one.

        Parameters
        ----------
        steps
            Numbers of the samples' steps, rising, shape (samples,).
        times
            Times [s], shape (samples,).
        values
            Velocities, shape (samples, channels).
        """
        parts, self.restarts, count = [], [], len(steps)
        if len(self._before) == 0:
            parts, self._before = [np.zeros_like(values[:1])], values[0]
            self._step, self._time = float(steps[0]), float(times[0])
            steps, times, values = steps[1:], times[1:], values[1:]
        if math.isnan(self._duration) and len(steps):
            self._duration = float((times[0] - self._time) / (steps[0] - self._step))
        spacings = np.rint(np.diff(steps, prepend=self._step)).astype(int)
        ends = [*(np.flatnonzero(np.diff(spacings)) + 1).tolist(), len(steps)]
        for begin, end in zip([0, *ends], ends, strict=False):
            if end > begin:
                if spacings[begin] != self._spacing:
                    self._restart(int(spacings[begin]))
                    self.restarts.append(count - len(steps) + begin)
                parts.append(self._filtered(values[begin:end]))
                self._step, self._before = float(steps[end - 1]), values[end - 1]
        return np.concatenate(parts)

    def _filtered(self, values: np.ndarray) -> np.ndarray:
        """Return evenly spaced values, shape (samples, channels), through the filter."""
        if len(self._sections) == 0:
            return np.zeros(values.shape)
        passed = np.ascontiguousarray(values.T)
        compiled(_through_sections)(self._sections, self._state, passed)
        return passed.T

    def _restart(self, spacing: int) -> None:
        """Restart the filter at rest for samples that are ``spacing`` steps apart."""
        self._spacing = spacing
        self._sections = _sections(1.0 / (spacing * self._duration))
        self._state = _at_rest(self._sections, self._before)


@lru_cache
def _sections(rate: float) -> np.ndarray:
    """Return b0, b1, b2, a1, a2 of the filter sections for a sample rate [Hz].

    Butterworth filters by the bilinear transform, equal to those of ``scipy.signal.butter``, whose
    import would take longer than the run. The shape is (sections, 5); a low rate gives no sections.
    """
    bands = [(LOWEST, np.array([1.0, -2.0, 1.0]))] if rate > 2.0 * LOWEST else []
    if rate > 2.0 * HIGHEST:
        bands.append((HIGHEST, np.array([1.0, 2.0, 1.0])))
    sections = []
    for edge, zeros in bands:
        k = math.tan(math.pi * edge / rate)
        for pair in range(ORDER // 2):
            damped = 2.0 * math.sin(math.pi * (2 * pair + 1) / (2 * ORDER)) * k
            whole = 1.0 + damped + k * k
            gain = (1.0 if zeros[1] < 0.0 else k * k) / whole
            poles = 2.0 * (k * k - 1.0) / whole, (1.0 - damped + k * k) / whole
            sections.append([*(gain * zeros), *poles])
    return np.array(sections).reshape(-1, 5)


def _at_rest(sections: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the state of filter sections after a long constant input.

    Parameters
    ----------
    sections
        b0, b1, b2, a1, a2 of each section, shape (sections, 5).
    values
        Constant input, shape (channels,).

    Returns
    -------
    np.ndarray
        State for ``_through_sections``, shape (sections, 2, channels).
    """
    state = np.empty((len(sections), 2, len(values)))
    for (b0, b1, b2, a1, a2), (first, second) in zip(sections, state, strict=True):
        passed = values * ((b0 + b1 + b2) / (1.0 + a1 + a2))
        first[:], second[:] = passed - b0 * values, b2 * values - a2 * passed
        values = passed
    return state


def _through_sections(sections: Table, state: Cube, values: Table) -> None:
    """Filter values in place, transposed direct form II; to be compiled.

    Parameters
    ----------
    sections
        b0, b1, b2, a1, a2 of each section, shape (sections, 5).
    state
        State of each section, shape (sections, 2, channels); modified.
    values
        Input and output, shape (channels, samples).
    """
    for channel in range(values.shape[0]):
        for k in range(values.shape[1]):
            x = values[channel, k]
            for s in range(sections.shape[0]):
                y = sections[s, 0] * x + state[s, 0, channel]
                state[s, 0, channel] = (
                    sections[s, 1] * x - sections[s, 3] * y + state[s, 1, channel]
                )
                state[s, 1, channel] = sections[s, 2] * x - sections[s, 4] * y
                x = y
            values[channel, k] = x


class BroadBand:
    """Largest vibration velocity along the axes of the scene's sensors, in a single run."""

    def __init__(self, runs: JudgedRuns, number: int) -> None:
        sensors = runs.scenes[number].sensors.values()
        self._places = [(np.array(sensor.position), sensor.axis_angle) for sensor in sensors]
        if not self._places:  # measure at C, along the deck's axes
            self._places = [(np.zeros(3), 0.0)]
        self._band = BandPass()
        self._squares, self._whole, self._count = np.zeros(1), np.zeros(1), 0
        self._fastest = self._fastest_late = 0.0
        self._peak, self._last = 0.0, np.empty((0, 2))
        self._resolved_late = self._resolved = True
        self._restarts = self._restarts_late = 0
        self._samples = runs.samples

    def take(self, samples: Trajectory, late: int) -> None:
        """Process the next samples."""
        steps, times = samples["step"], samples["time"]
        instants = np.column_stack((times, samples["angle"]))
        interval, turn = np.abs(np.diff(instants, axis=0, prepend=self._last)).T
        # Allow for rounded times.
        near = (interval <= _WIDEST * (1.0 + 1e-6)) & (turn <= TURN)
        self._resolved &= bool(near.all())
        self._resolved_late &= bool(near[max(len(near) - late, 0) :].all())
        self._last = instants[-1:]
        velocities, speed = self._velocities(samples), np.abs(samples["speed"])
        self._fastest = max(self._fastest, float(speed.max()))
        passed = self._band.passed(steps, times, velocities)
        restarts = np.array(self._band.restarts)
        self._restarts += len(restarts)
        self._restarts_late += int(np.count_nonzero(restarts >= len(steps) - late))
        self._peak = max(self._peak, float(np.max(np.abs(passed))))
        if late:
            self._fastest_late = max(self._fastest_late, float(speed[-late:].max()))
            self._squares = self._squares + np.sum(passed[-late:] ** 2, axis=0)
            self._whole = self._whole + np.sum(velocities[-late:] ** 2, axis=0)
            self._count += late

    @property
    def reason_without_value(self) -> str | None:
        """Reason why ``final`` has no value; None if it has one."""
        most = _RESTARTS + _RESTARTS_PER_SAMPLE * self._count
        if not self._resolved_late or self._restarts_late > most:
            return "samples are uneven or too far apart"
        return _outside_band(self._fastest_late)

    @property
    def final(self) -> float | None:
        """Root mean square over the last stretch, for the axis with the largest value [m/s]."""
        if self.reason_without_value is not None:
            return None
        return math.sqrt(float(np.max(self._squares)) / self._count)

    @property
    def whole(self) -> float:
        """Root mean square of unfiltered velocity at the run's end [m/s], on its largest axis."""
        return math.sqrt(float(np.max(self._whole)) / self._count)

    @property
    def peak(self) -> float | None:
        """Largest magnitude along any axis in the whole run [m/s]; None if it is not resolved."""
        even = self._restarts <= _RESTARTS + _RESTARTS_PER_SAMPLE * self._samples
        inside = _outside_band(self._fastest) is None
        return self._peak if self._resolved and even and inside else None

    def _velocities(self, samples: Trajectory) -> np.ndarray:
        """Return the velocities along all axes of all positions [m/s], shape (samples, axes)."""
        columns = []
        for position, angle in self._places:
            velocity = samples.velocity
            if samples.tilts:
                turning = np.cross(samples.angular_velocity, ordered_dot(samples.turned, position))
                to_deck = samples.turned.swapaxes(1, 2)
                velocity = ordered_dot(to_deck, (velocity + turning)[:, None])
            cosine, sine = math.cos(angle), math.sin(angle)
            x, y = velocity[:, 0], velocity[:, 1]
            columns += [cosine * x + sine * y, cosine * y - sine * x, *velocity.T[2:]]
        return np.column_stack(columns)


def _outside_band(speed: float) -> str | None:
    """Return the reason why the band excludes once-per-turn vibration; None if it does not.

    Parameters
    ----------
    speed
        Largest spindle speed [rad/s]; a spindle at rest has no such vibration.
    """
    turns = speed / (2.0 * math.pi)
    if turns == 0.0 or LOWEST <= turns <= HIGHEST:
        return None
    where = "above" if turns > HIGHEST else "below"
    return f"the spindle's {turns:.4g} turns a second are {where} the band"


class BroadBandAccumulator(EachRun):
    """Largest vibration velocity along the axes of the scene's sensors."""

    KIND = BroadBand

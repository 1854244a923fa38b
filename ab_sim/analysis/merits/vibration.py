"""How fast the deck vibrates: broad-band velocity, as ISO 20816-1 judges machines by it.

What an ideal instrument shows that is fixed to the deck where a sensor sits: its velocity along
each of the sensor's axes, through a high-pass of 10 Hz and a low-pass of 1000 Hz. The standard
names the quantity and the band; the filters, Butterworth ones of the fourth order, are ours.
"""

import math
from functools import lru_cache

import numpy as np

from ab_sim.analysis.merits.each_run import EachRun, JudgedRun
from ab_sim.compiling import Cube, Table, compiled
from ab_sim.drive.trajectory import Trajectory

LOWEST, HIGHEST = 10.0, 1000.0
"""Hz: where the filters are 3 dB down (ISO 20816-1, broad-band velocity)."""
ORDER = 4
WIDEST = 0.01
"""s, and ..."""
TURN = 0.5 * math.pi
"""... rad of the spindle: samples further apart show neither the band's lower end nor what comes
with each turn."""

BEGUN, EVENLY = 2, 0.01
"""The filters may begin anew so often, and at this share of the samples; who does it all the time
lets nothing through."""


class BandPass:
    """Lets velocities through from 10 to 1000 Hz, as they come.

    It begins as if the first ones had been there for ever, and anew where samples are spaced
    otherwise. Where half the rate of samples is no more than 1000 Hz there is nothing to cut off.
    """

    def __init__(self) -> None:
        self._step, self._time, self._before = math.nan, math.nan, np.empty(0)
        self._spacing, self._duration = -1, math.nan
        self.begun: list[int] = []
        """Where among the newest samples it has begun."""
        self._sections, self._state = np.empty((0, 5)), np.empty((0, 2, 0))

    def passed(self, steps: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        """What comes through of the next samples, at least one.

        Args:
            steps: numbers of the samples' steps, rising, shape (samples,).
            times: s, shape (samples,).
            values: shape (samples, channels).
        """
        parts, self.begun, count = [], [], len(steps)
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
                    self._begin(int(spacings[begin]))
                    self.begun.append(count - len(steps) + begin)
                parts.append(self._evenly(values[begin:end]))
                self._step, self._before = float(steps[end - 1]), values[end - 1]
        return np.concatenate(parts)

    def _evenly(self, values: np.ndarray) -> np.ndarray:
        if len(self._sections) == 0:
            return np.zeros(values.shape)
        passed = np.ascontiguousarray(values.T)
        compiled(through_sections)(self._sections, self._state, passed)
        return passed.T

    def _begin(self, spacing: int) -> None:
        self._spacing = spacing
        self._sections = _sections(1.0 / (spacing * self._duration))
        self._state = _at_rest(self._sections, self._before)


@lru_cache
def _sections(rate: float) -> np.ndarray:
    """Return b0, b1, b2, a1, a2 of the filters' sections for a rate of samples [Hz].

    Butterworth filters by the bilinear transform, as ``scipy.signal.butter`` makes them, whose
    import would take longer than the run. Shape (sections, 5); no sections where the rate is low.
    """
    bands = [(LOWEST, np.array([1.0, -2.0, 1.0]))] if rate > 2.0 * LOWEST else []
    if rate > 2.0 * HIGHEST:
        bands.append((HIGHEST, np.array([1.0, 2.0, 1.0])))
    found = []
    for edge, zeros in bands:
        k = math.tan(math.pi * edge / rate)
        for pair in range(ORDER // 2):
            damped = 2.0 * math.sin(math.pi * (2 * pair + 1) / (2 * ORDER)) * k
            whole = 1.0 + damped + k * k
            gain = (1.0 if zeros[1] < 0.0 else k * k) / whole
            poles = 2.0 * (k * k - 1.0) / whole, (1.0 - damped + k * k) / whole
            found.append([*(gain * zeros), *poles])
    return np.array(found).reshape(-1, 5)


def _at_rest(sections: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the states after these values were there for ever, shape (sections, 2, channels)."""
    state = np.empty((len(sections), 2, len(values)))
    for (b0, b1, b2, a1, a2), (first, second) in zip(sections, state, strict=True):
        passed = values * ((b0 + b1 + b2) / (1.0 + a1 + a2))
        first[:], second[:] = passed - b0 * values, b2 * values - a2 * passed
        values = passed
    return state


def through_sections(sections: Table, state: Cube, values: Table) -> None:
    """Filter values in place, transposed direct form II; to be compiled.

    Args:
        sections: b0, b1, b2, a1, a2 of each, shape (sections, 5).
        state: of each, shape (sections, 2, channels); changes.
        values: shape (channels, samples).
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
    """The largest vibration velocity along the axes of the scene's sensors, in a single run."""

    def __init__(self, run: JudgedRun) -> None:
        sensors = run.scene.sensors.values()
        self._places = [(np.array(each.position), each.axis_angle) for each in sensors]
        if not self._places:  # C, on the deck's axes
            self._places = [(np.zeros(3), 0.0)]
        self._band = BandPass()
        self._squares, self._whole, self._count = np.zeros(1), np.zeros(1), 0
        self._fastest = self._fastest_late = 0.0
        self._peak, self._last = 0.0, np.empty((0, 2))
        self._shown_late = self._shown = True
        self._begun = self._begun_late = 0
        self._samples = run.samples

    def take(self, samples: Trajectory, late: int) -> None:
        """The next samples."""
        steps, times = samples["step"], samples["time"]
        at = np.column_stack((times, samples["angle"]))
        apart = np.abs(np.diff(at, axis=0, prepend=self._last))
        # Times have been rounded.
        near = (apart[:, 0] <= WIDEST * (1.0 + 1e-6)) & (apart[:, 1] <= TURN)
        self._shown &= bool(near.all())
        self._shown_late &= bool(near[max(len(near) - late, 0) :].all())
        self._last = at[-1:]
        velocities, speed = self._velocities(samples), np.abs(samples["speed"])
        self._fastest = max(self._fastest, float(speed.max()))
        passed = self._band.passed(steps, times, velocities)
        begun = np.array(self._band.begun)
        self._begun += len(begun)
        self._begun_late += int(np.count_nonzero(begun >= len(steps) - late))
        self._peak = max(self._peak, float(np.max(np.abs(passed))))
        if late:
            self._fastest_late = max(self._fastest_late, float(speed[-late:].max()))
            self._squares = self._squares + np.sum(passed[-late:] ** 2, axis=0)
            self._whole = self._whole + np.sum(velocities[-late:] ** 2, axis=0)
            self._count += late

    @property
    def why_not(self) -> str | None:
        """Why there is no final value; None if there is one."""
        if not self._shown_late or self._begun_late > BEGUN + EVENLY * self._count:
            return "samples are uneven or too far apart"
        return _beside_the_band(self._fastest_late)

    @property
    def final(self) -> float | None:
        """Root mean square over the last stretch, of the axis where it is largest [m/s]."""
        if self.why_not is not None:
            return None
        return math.sqrt(float(np.max(self._squares)) / self._count)

    @property
    def whole(self) -> float:
        """The same of the velocity at all frequencies [m/s]."""
        return math.sqrt(float(np.max(self._whole)) / self._count)

    @property
    def peak(self) -> float | None:
        """Largest magnitude of the run along any axis [m/s]."""
        evenly = self._begun <= BEGUN + EVENLY * self._samples
        inside = _beside_the_band(self._fastest) is None
        return self._peak if self._shown and evenly and inside else None

    def _velocities(self, samples: Trajectory) -> np.ndarray:
        """Along all axes of all places [m/s], shape (samples, axes)."""
        columns = []
        for position, angle in self._places:
            velocity = samples.velocity
            if samples.tilts:
                turning = np.cross(samples.angular_velocity, samples.turned @ position)
                # A row times the matrix that turns to the ground's axes is turned back.
                velocity = ((velocity + turning)[:, None, :] @ samples.turned)[:, 0]
            cosine, sine = math.cos(angle), math.sin(angle)
            x, y = velocity[:, 0], velocity[:, 1]
            columns += [cosine * x + sine * y, cosine * y - sine * x, *velocity.T[2:]]
        return np.column_stack(columns)


def _beside_the_band(speed: float) -> str | None:
    """Say why the band leaves out what comes once per turn; None if it does not.

    Args:
        speed: the spindle's largest [rad/s]; a spindle at rest has no such part.
    """
    turns = speed / (2.0 * math.pi)
    if turns == 0.0 or LOWEST <= turns <= HIGHEST:
        return None
    where = "above" if turns > HIGHEST else "below"
    return f"the spindle's {turns:.4g} turns a second are {where} the band"


class BroadBandWatch(EachRun[BroadBand]):
    """The largest vibration velocity along the axes of the scene's sensors."""

    KIND = BroadBand

    @property
    def final(self) -> list[float | None]:
        """See ``BroadBand``."""
        return [each.final for each in self.each]

    @property
    def whole(self) -> list[float]:
        """See ``BroadBand``."""
        return [each.whole for each in self.each]

    @property
    def why_not(self) -> list[str | None]:
        """See ``BroadBand``."""
        return [each.why_not for each in self.each]

    @property
    def peak(self) -> list[float | None]:
        """See ``BroadBand``."""
        return [each.peak for each in self.each]

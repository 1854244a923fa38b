"""Signal chain of a sensor, from the measured quantity at every integration step to readings.

An accelerometer senses specific force [m/s^2], and a proximity probe displacement [m]: statements
on forces here hold for displacements in their unit, too.

The low-pass is H(s) = w^2 / (s^2 + sqrt(2) w s + w^2), w = 2 pi F_c, with the poles p and p*, p = w
(-1 + i) / sqrt(2). For its input g, the part not yet followed is

    g - H g = Re z + Im z,   z' = p z + g'

and for g linear over a step h, which is the first-order (triangle) hold of Franklin, Powell and
Workman, Digital Control of Dynamic Systems, 3rd ed., section 6.3,

    z_k+1 = exp(p h) z_k + (exp(p h) - 1) / (p h) (g_k+1 - g_k)

is exact. The recursion is stable for every bandwidth, a constant passes unchanged to the last bit,
and one complex number per axis is the whole state.
"""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.engine.compiling import compiled
from ab_sim.engine.compiling.kinds import Floats, Table
from ab_sim.scene.sensors import Sampled, steps_per_sample

NOISE_BLOCK = 1024
"""Number of steps whose noise is drawn together; the noise of a seed depends on it."""

_STREAM = 0x616363656C65726F
"""Half of the generator's key, so that sensor noise differs from other draws with the seed."""


class PickupState(NamedTuple):
    """All values on which later readings depend, except the parameters and later forces."""

    mode: np.ndarray
    """The low-pass' z, per axis [m/s^2], complex, shape (axes,)."""
    force: np.ndarray
    """Last input of the low-pass, noise included, per axis [m/s^2]."""
    reading: np.ndarray
    """Held reading, per axis [m/s^2]."""


class LowPass(NamedTuple):
    """Complex factors of one step: ``decay`` of z, and ``drive`` of the input's change."""

    decay: float
    decay_i: float
    drive: float
    drive_i: float
    """Factors, each as real part and, with suffix ``_i``, imaginary part."""


def _low_pass(filter_: LowPass, force: Table, mode: Table, last: Floats, passed: Table) -> None:
    """Apply a sensor's low-pass step by step: the result does not depend on the grouping of calls.

    Parameters
    ----------
    filter_
        Factors of the low-pass.
    force
        Input [m/s^2], shape (steps, axes).
    mode
        z of each axis, real and imaginary part, shape (axes, 2); modified in place.
    last
        Last input of each axis [m/s^2], shape (axes,); modified in place.
    passed
        Receives the output [m/s^2], shape (steps, axes).
    """
    for k in range(force.shape[0]):
        for i in range(force.shape[1]):
            change, re, im = force[k, i] - last[i], mode[i, 0], mode[i, 1]
            mode[i, 0] = (filter_.decay * re - filter_.decay_i * im) + filter_.drive * change
            mode[i, 1] = (filter_.decay * im + filter_.decay_i * re) + filter_.drive_i * change
            last[i] = force[k, i]
            passed[k, i] = last[i] - (mode[i, 0] + mode[i, 1])


def noise_variance(sensor: Sampled, step: float) -> float:
    """Return the noise variance of a reading per axis [(m/s^2)^2]: filtered noise and quantisation.

    The impulse response of the low-pass is 1 - (Re + Im) D at once, and -(Re + Im) c d^(n-1) after
    n steps, with d = exp(p h), D = (d - 1) / (p h), c = (d - 1) D. The sum of its squares is the
    fraction of white noise that passes. Rounding to q adds q^2/12, the variance of a uniform error.
    """
    turn, drive, size = _chain(sensor, step)
    fell = complex(np.expm1(turn)) * drive
    later = abs(fell) ** 2 / -math.expm1(2.0 * turn.real)
    later += (-1j * fell**2 / -complex(np.expm1(2.0 * turn))).real
    passed = (1.0 - drive.real - drive.imag) ** 2 + later
    return size**2 * passed + sensor.resolution**2 / 12.0


def _chain(sensor: Sampled, step: float) -> tuple[complex, complex, float]:
    """Return p h, (exp(p h) - 1) / (p h), and the size of the noise at a step [m/s^2]."""
    turn = 2.0 * math.pi * sensor.bandwidth * step * complex(-1.0, 1.0) / math.sqrt(2.0)
    # White up to half the integration rate, with the one-sided spectrum noise_density^2.
    size = sensor.noise_density * math.sqrt(0.5 / step)
    return turn, complex(np.expm1(turn) / turn), size


def low_pass_of(sensor: Sampled, step: float) -> LowPass:
    """Return a sensor's low-pass over an integration step [s]."""
    turn, drive, _ = _chain(sensor, step)
    decay = complex(np.exp(turn))
    return LowPass(decay.real, decay.imag, drive.real, drive.imag)


class Pickup:
    """Sensor that converts specific force (accelerometer) or displacement (probe) to readings.

    Steps are counted as in ``Trajectory``: the state at t = 0 is step 0. Readings are bit-identical
    however the steps are grouped into calls, and after restoring a ``state``. The noise of a step
    depends on the seed, the stream and the step's number only.

    Parameters
    ----------
    sensor
        Parameters of the sensor.
    step
        Integration step [s].
    axes
        Number of axes: 2, or 3 on a deck that moves in space, the third along the shaft.
    stream
        Number of earlier sensors with the same seed, so that their noise differs.

    Raises
    ------
    ValueError
        The number of steps between samples is not an integer.
    """

    def __init__(self, sensor: Sampled, step: float, axes: int = 2, stream: int = 0) -> None:
        self.sensor = sensor
        self._stream = stream
        self.axes = axes
        self.step = step
        self.steps_per_sample = steps_per_sample(sensor.sample_rate, step)
        self._noise_size = _chain(sensor, step)[2]
        self._filter = low_pass_of(sensor, step)
        self._block = -1
        self._block_noise = np.empty((0, self.axes))
        self.reset(np.zeros(self.axes))
        # Compiled here, so that a live drive does not have to wait for it.
        self._pass(np.empty((0, self.axes)))

    def reset(self, initial: np.ndarray) -> None:
        """Reset to the steady state under a constant input without noise.

        Parameters
        ----------
        initial
            Input on inertial axes [m/s^2], shape (axes,); its reading is held until the first
            sample.
        """
        force = self._on_axes(np.asarray(initial, dtype=float).reshape(1, self.axes))[0]
        self._mode = np.zeros(self.axes, dtype=complex)
        self._force = force
        self._reading = self._digits(force)

    @property
    def reading(self) -> np.ndarray:
        """Held reading [m/s^2], shape (axes,)."""
        return self._reading.copy()

    @property
    def state(self) -> PickupState:
        """Present state of the sensor; assign an earlier one to return to that instant."""
        return PickupState(self._mode.copy(), self._force.copy(), self._reading.copy())

    @state.setter
    def state(self, state: PickupState) -> None:
        self._mode, self._force, self._reading = (part.copy() for part in state)

    def process(self, first_step: int, specific_force: np.ndarray) -> np.ndarray:
        """Return the readings at the end of consecutive integration steps.

        Parameters
        ----------
        first_step
            Number of the first of these steps, one after the last of the previous call.
        specific_force
            Acceleration minus gravity at the end of each step, on inertial axes [m/s^2], shape
            (steps, axes).

        Returns
        -------
        np.ndarray
            Readings on the sensor's axes [m/s^2], shape (steps, axes). The sensor takes a sample at
            every step whose number is a multiple of ``steps_per_sample``, and holds it.
        """
        force = self._on_axes(np.asarray(specific_force, dtype=float))
        count = len(force)
        if count == 0:
            return np.empty((0, self.axes))
        if self._noise_size:
            force += self.noise(first_step, count)
        passed = self._pass(force)
        every = self.steps_per_sample
        digitised = np.vstack((self._reading, self._digits(passed[-first_step % every :: every])))
        # Row 0 is the reading held so far, and each sample adds a row. So the index of a step's
        # reading is the number of samples taken up to then in this call.
        steps = np.arange(first_step, first_step + count)
        readings = digitised[steps // every - (first_step - 1) // every]
        self._reading = readings[-1].copy()
        return readings

    def _pass(self, force: np.ndarray) -> np.ndarray:
        """Return the output of the low-pass, shape (steps, axes)."""
        force, passed = np.ascontiguousarray(force), np.empty(force.shape)
        parts = self._mode.view(np.float64).reshape(self.axes, 2)
        compiled(_low_pass)(self._filter, force, parts, self._force, passed)
        return passed

    def _on_axes(self, force: np.ndarray) -> np.ndarray:
        """Return the input on the sensor's axes, shape (steps, axes)."""
        # No matrix product: its rounding depends on the number of rows.
        x, y = force[:, 0], force[:, 1]
        cosine = math.cos(self.sensor.axis_angle)
        sine = math.sin(self.sensor.axis_angle)
        turned = cosine * x + sine * y, cosine * y - sine * x
        return np.column_stack((*turned, *force.T[2:]))

    def noise(self, first_step: int, count: int) -> np.ndarray:
        """Return the noise of consecutive steps [m/s^2], shape (count, axes)."""
        start = first_step % NOISE_BLOCK
        blocks = range(first_step // NOISE_BLOCK, (first_step + count - 1) // NOISE_BLOCK + 1)
        drawn = [self._noise_of_block(block) for block in blocks]
        noise = drawn[0] if len(drawn) == 1 else np.concatenate(drawn)
        return noise[start : start + count]

    def _noise_of_block(self, block: int) -> np.ndarray:
        """Return the noise of ``NOISE_BLOCK`` steps; the last block is cached."""
        if block != self._block:
            # A counter-based generator (Salmon et al. (2011), SC '11) starts anywhere, so a step's
            # noise needs no earlier steps. Neighbouring blocks are 2^64 random numbers apart,
            # streams 2^128.
            at = (self._stream << 128) | (block << 64)
            bits = np.random.Philox(key=(_STREAM << 64) | self.sensor.seed, counter=at)
            normal = np.random.Generator(bits).standard_normal((NOISE_BLOCK, self.axes))
            self._block, self._block_noise = block, self._noise_size * normal
        return self._block_noise

    def _digits(self, force: np.ndarray) -> np.ndarray:
        return digits(self.sensor, force)


def digits(sensor: Sampled, force: np.ndarray) -> np.ndarray:
    """Return the output of a sensor's converter for a force on its axes [m/s^2]."""
    limit, resolution = sensor.range, sensor.resolution
    clipped = np.clip(force, -limit, limit)
    return resolution * np.rint(clipped / resolution) if resolution else clipped

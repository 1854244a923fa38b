"""A sensor's signal chain, from what it senses at every integration step to readings.

An accelerometer senses specific force [m/s^2], and a proximity probe displacement [m]: what is said
of forces here holds of that, in its unit.

The low-pass is H(s) = w^2 / (s^2 + sqrt(2) w s + w^2), w = 2 pi F_c, with the poles p and p*,
p = w (-1 + i) / sqrt(2). Of its input g, what it has not followed yet is

    g - H g = Re z + Im z,   z' = p z + g'

and for a g that runs straight over a step h, which is the first-order (triangle) hold of
Franklin, Powell and Workman, Digital Control of Dynamic Systems, 3rd ed., section 6.3,

    z_k+1 = exp(p h) z_k + (exp(p h) - 1) / (p h) (g_k+1 - g_k)

is exact. It is stable for every bandwidth, a constant passes unchanged to the last bit, and one
complex number per axis is the whole state.
"""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.compiling import compiled
from ab_sim.compiling.kinds import Floats, Table
from ab_sim.scene.sensors import Sampled, steps_per_sample

NOISE_BLOCK = 1024
"""Steps whose noise is drawn together; a part of what a seed means."""

_STREAM = 0x616363656C65726F
"""Half of the generator's key: another sensor with the same seed gets other noise."""


class PickupState(NamedTuple):
    """Everything that later readings depend on, besides the parameters and later forces."""

    mode: np.ndarray
    """The low-pass' z, per axis [m/s^2], complex, shape (axes,)."""
    force: np.ndarray
    """Last input of the low-pass, noise included, per axis [m/s^2]."""
    reading: np.ndarray
    """The reading that is held, per axis [m/s^2]."""


class LowPass(NamedTuple):
    """What one step makes of z: a complex factor, and another one of the input's change."""

    decay: float
    decay_i: float
    drive: float
    drive_i: float
    """Imaginary parts behind the real ones."""


def low_pass(own: LowPass, force: Table, mode: Table, last: Floats, passed: Table) -> None:
    """Let a force go through, one step after the other: the order of operations knows no calls.

    Args:
        own: the low-pass.
        force: its input, shape (steps, axes).
        mode: z of each axis, real and imaginary part, shape (axes, 2); changes.
        last: its last input, shape (axes,); changes.
        passed: where its output goes, shape (steps, axes).
    """
    for k in range(force.shape[0]):
        for i in range(force.shape[1]):
            change, re, im = force[k, i] - last[i], mode[i, 0], mode[i, 1]
            mode[i, 0] = (own.decay * re - own.decay_i * im) + own.drive * change
            mode[i, 1] = (own.decay * im + own.decay_i * re) + own.drive_i * change
            last[i] = force[k, i]
            passed[k, i] = last[i] - (mode[i, 0] + mode[i, 1])


def noise_variance(sensor: Sampled, step: float) -> float:
    """Of a reading, per axis [(m/s^2)^2]: white noise through the low-pass, and quantisation.

    The low-pass answers an impulse with 1 - (Re + Im) D, and n steps later with the negative
    (Re + Im) of c d^(n-1), d = exp(p h), D = (d - 1) / (p h), c = (d - 1) D; the squares of these
    add up to the noise's part that passes. Rounding to q adds q^2/12, as of a uniform error.
    """
    turn, drive, size = _chain(sensor, step)
    fell = complex(np.expm1(turn)) * drive
    later = abs(fell) ** 2 / -math.expm1(2.0 * turn.real)
    later += (-1j * fell**2 / -complex(np.expm1(2.0 * turn))).real
    passed = (1.0 - drive.real - drive.imag) ** 2 + later
    return size**2 * passed + sensor.resolution**2 / 12.0


def _chain(sensor: Sampled, step: float) -> tuple[complex, complex, float]:
    """p h, (exp(p h) - 1) / (p h), and the size of the noise at a step [m/s^2]."""
    turn = 2.0 * math.pi * sensor.bandwidth * step * complex(-1.0, 1.0) / math.sqrt(2.0)
    # White up to half the integration rate, with the one-sided spectrum noise_density^2.
    size = sensor.noise_density * math.sqrt(0.5 / step)
    return turn, complex(np.expm1(turn) / turn), size


def low_pass_of(sensor: Sampled, step: float) -> LowPass:
    """A sensor's low-pass over an integration step [s]."""
    turn, drive, _ = _chain(sensor, step)
    decay = complex(np.exp(turn))
    return LowPass(decay.real, decay.imag, drive.real, drive.imag)


class Pickup:
    """Turns specific force into an accelerometer's readings, or displacement into a probe's.

    Steps are counted as in ``Trajectory``: the state at t = 0 is step 0. Readings are
    bit-identical however the steps are grouped into calls, and after going back to a ``state``.
    The noise of a step depends on the seed and the step's number only.

    Args:
        sensor: its parameters.
        step: integration step [s].
        axes: how many it has: 2, or 3 on a deck that moves in space, the third along the shaft.

    Raises:
        ValueError: there is no whole number of steps between samples.
    """

    def __init__(self, sensor: Sampled, step: float, axes: int = 2) -> None:
        self.sensor = sensor
        self.axes = axes
        self.step = step
        self.steps_per_sample = steps_per_sample(sensor.sample_rate, step)
        self._noise_size = _chain(sensor, step)[2]
        self._filter = low_pass_of(sensor, step)
        self._block = -1
        self._block_noise = np.empty((0, self.axes))
        self.reset(np.zeros(self.axes))
        # Compiled here, so that no live drive has to wait for it.
        self._pass(np.empty((0, self.axes)))

    def reset(self, initial: np.ndarray) -> None:
        """Start anew, as if ``initial`` [m/s^2], on inertial axes, had acted for ever, noiseless.

        The reading that is held until the first sample is that of ``initial``.
        """
        force = self._on_axes(np.asarray(initial, dtype=float).reshape(1, self.axes))[0]
        self._mode = np.zeros(self.axes, dtype=complex)
        self._force = force
        self._reading = self._digits(force)

    @property
    def reading(self) -> np.ndarray:
        """The reading that is held [m/s^2], shape (axes,)."""
        return self._reading.copy()

    @property
    def state(self) -> PickupState:
        """What to keep for going back to this instant; setting it goes there."""
        return PickupState(self._mode.copy(), self._force.copy(), self._reading.copy())

    @state.setter
    def state(self, state: PickupState) -> None:
        self._mode, self._force, self._reading = (part.copy() for part in state)

    def process(self, first_step: int, specific_force: np.ndarray) -> np.ndarray:
        """Readings at the end of consecutive integration steps.

        Args:
            first_step: number of the first of these steps; one more than the last one's of the
                call before.
            specific_force: acceleration minus gravity at the end of each step, on inertial axes
                [m/s^2], shape (steps, axes).

        Returns:
            What the sensor shows then, on its own axes [m/s^2], shape (steps, axes). It takes a
            sample at every step whose number is a multiple of ``steps_per_sample``, and holds it.
        """
        force = self._on_axes(np.asarray(specific_force, dtype=float))
        count = len(force)
        if count == 0:
            return np.empty((0, self.axes))
        if self._noise_size:
            force += self._noise(first_step, count)
        passed = self._pass(force)
        every = self.steps_per_sample
        shown = np.vstack((self._reading, self._digits(passed[-first_step % every :: every])))
        steps = np.arange(first_step, first_step + count)
        readings = shown[steps // every - (first_step - 1) // every]
        self._reading = readings[-1].copy()
        return readings

    def _pass(self, force: np.ndarray) -> np.ndarray:
        """What comes out of the low-pass, shape (steps, axes)."""
        force, passed = np.ascontiguousarray(force), np.empty(force.shape)
        parts = self._mode.view(np.float64).reshape(self.axes, 2)
        compiled(low_pass)(self._filter, force, parts, self._force, passed)
        return passed

    def _on_axes(self, force: np.ndarray) -> np.ndarray:
        # No matrix product: how those round depends on the number of rows.
        x, y = force[:, 0], force[:, 1]
        cosine = math.cos(self.sensor.axis_angle)
        sine = math.sin(self.sensor.axis_angle)
        turned = cosine * x + sine * y, cosine * y - sine * x
        return np.column_stack((*turned, *force.T[2:]))

    def _noise(self, first_step: int, count: int) -> np.ndarray:
        start = first_step % NOISE_BLOCK
        blocks = range(first_step // NOISE_BLOCK, (first_step + count - 1) // NOISE_BLOCK + 1)
        drawn = [self._noise_of_block(block) for block in blocks]
        noise = drawn[0] if len(drawn) == 1 else np.concatenate(drawn)
        return noise[start : start + count]

    def _noise_of_block(self, block: int) -> np.ndarray:
        if block != self._block:
            # 2^64 numbers lie between neighbouring blocks.
            bits = np.random.Philox(key=(_STREAM << 64) | self.sensor.seed, counter=block << 64)
            normal = np.random.Generator(bits).standard_normal((NOISE_BLOCK, self.axes))
            self._block, self._block_noise = block, self._noise_size * normal
        return self._block_noise

    def _digits(self, force: np.ndarray) -> np.ndarray:
        return digits(self.sensor, force)


def digits(sensor: Sampled, force: np.ndarray) -> np.ndarray:
    """What a sensor's converter makes of a force on its axes [m/s^2]."""
    limit, resolution = sensor.range, sensor.resolution
    clipped = np.clip(force, -limit, limit)
    return resolution * np.rint(clipped / resolution) if resolution else clipped

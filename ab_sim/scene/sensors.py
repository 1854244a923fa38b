"""Sensors of a scene, accelerometers and proximity probes, and the names of a drive's frames.

Sensors measure, and do not act on the motion. Frames' names are shared by tf, messages and the URDF
(docs/topics.md).
"""

import math
import re
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator

from ab_sim.base.errors import exact
from ab_sim.scene.quantities import Count, InSchema, Length, Number, Section, quantity

HOUSING = "drive_housing"
"""Frame fixed in space."""
DECK = "deck"
SPINDLE = "spindle"
"""Frame that turns with the disc; x points at the unbalance."""


def race_frame(number: int) -> str:
    """Return the name of a race's frame, which turns with the spindle, at the balls' height."""
    return f"race_{number}"


def ball_frame(number: int) -> str:
    """Return the name of the frame at a ball's centre, whose x axis points away from the shaft."""
    return f"ball_{number}"


def arm_frame(number: int) -> str:
    """Return the name of the frame on the shaft whose x axis points at a ball."""
    return f"{ball_frame(number)}_arm"


_RESERVED = rf"{HOUSING}|{DECK}|{SPINDLE}|race_\d+|ball_\d+(_arm)?"
"""Regular expression of the names that are reserved for a drive's own frames."""


def _is_reserved(name: str) -> bool:
    """Return whether a name is reserved for a drive's own frames, so that no sensor may have it."""
    return re.fullmatch(_RESERVED, name) is not None


RATE_TOLERANCE = 1e-6
"""Relative tolerance of sample rates: a rate with about six digits counts as the exact rate."""
ALIASING = 0.1
"""Gain of a sensor's low-pass at half the sample rate above which a warning states that the sensor
may alias. At this gain, the low-pass attenuates higher frequencies by at least 20 dB, and by 12 dB
more per octave."""


class Sampled(Section):
    """Common part of all sensors: axes, low-pass filter, sampling, noise and resolution."""

    unit: ClassVar[str]
    """Unit of a reading."""

    position: tuple[Length, Length, Length] = quantity(
        "position of the sensor from C, on deck axes; only with a deck in space",
        "m",
        default=(0.0, 0.0, 0.0),
    )
    axis_angle: Number = quantity(
        "phi, angle from the deck's x axis to the sensor's first axis; the second axis is "
        "pi/2 ahead",
        "rad",
        ge=-1e3,
        le=1e3,
        default=0.0,
    )
    range: Number
    noise_density: Number
    bandwidth: Number = quantity(
        "F_c, -3 dB frequency of the low-pass filter", "Hz", ge=1e-3, le=1e9, default=100.0
    )
    sample_rate: Number = quantity(
        "F_s, sample rate; a whole number of steps per sample",
        "Hz",
        ge=1e-3,
        le=1e9,
        default=1000.0,
    )
    resolution: Number
    seed: Count = quantity(
        "seed of the noise; sensors with the same seed have different noise",
        "1",
        ge=0,
        le=10**9,
        default=0,
    )

    def gain(self, frequency: float) -> float:
        """Return the gain of the low-pass filter, |B|, at a frequency [Hz]."""
        return 1.0 / math.hypot(1.0, (frequency / self.bandwidth) ** 2)

    def aliasing(self, step: float) -> str:
        """Return a warning if vibration above half the sample rate may alias, else an empty text.

        Parameters
        ----------
        step
            Integration step [s]; a sensor that samples at each step does not alias.
        """
        half = 0.5 * self.sample_rate
        if steps_per_sample(self.sample_rate, step) == 1 or self.gain(half) <= ALIASING:
            return ""
        low_enough = half * (1.0 / ALIASING**2 - 1.0) ** -0.25
        return (
            f"aliases: up to {100 * self.gain(half):.0f} % of the amplitude of vibration above "
            f"{half:g} Hz, half its sample_rate, appears at lower frequencies; for less than "
            f"{100 * ALIASING:g} % lower its bandwidth below {low_enough:.4g} Hz, or sample faster"
        )

    def check(self, key: str, step: float | None) -> None:
        """Check conditions that involve several parameters.

        Parameters
        ----------
        key
            Name of the sensor in messages.
        step
            Integration step [s]; None if a step that suits the sensor is chosen later.

        Raises
        ------
        ValueError
            The resolution exceeds the range, the sample rate does not fit the step, or the
            bandwidth is too high for it; the message names value and allowed range.
        """
        if self.resolution > self.range:
            raise ValueError(
                f"{key}.resolution = {exact(self.resolution)} {self.unit}: must be at "
                f"most the range, {exact(self.range)} {self.unit}; or 0 for none"
            )
        if step is None:
            return
        try:
            steps_per_sample(self.sample_rate, step)
        except ValueError as error:
            raise ValueError(f"{key}.{error}") from None
        highest = 0.5 / step
        if self.bandwidth > highest * (1 + RATE_TOLERANCE):
            raise ValueError(
                f"{key}.bandwidth = {self.bandwidth:.10g} Hz: must be at most "
                f"half the integration rate, {highest:.10g} Hz at solver.step = {step:g} s; "
                "lower it, or the step"
            )


class Accelerometer(Sampled):
    """Accelerometer on the deck; it does not act on the dynamics.

    It has two axes across the shaft, and on a deck in space a third along it; all turn with the
    deck.

    It senses specific force f, acceleration minus gravity. In physical order: f is turned into the
    sensor's axes, white noise is added, a second-order Butterworth low-pass follows, then come
    sampling, range and quantisation (``ab_sim.drive.pickup.Pickup``).

    In the plane the deck does not turn, so the reading is the same at every point; in space it
    depends on the position.

    The low-pass interpolates the force linearly between integration steps. That reduces the
    amplitude by the fraction (pi F h)^2 / 3 at the frequency F with the step h: at F_c the gain is
    -3.02 dB with F_c h = 1/50, -3.3 dB with 1/10 and -39 dB with 1/2.
    """

    unit: ClassVar[str] = "m/s^2"
    equation: ClassVar[str] = (
        "s = q round(clip(B(A(phi) f + n), -s_max, s_max) / q) at t = k / F_s; "
        "|B(F)|^2 = 1 / (1 + (F / F_c)^4), S_n = N^2"
    )
    source: ClassVar[str] = (
        "parameters as in IEEE Std 2700 and MEMS data sheets; the standard sampled-data chain; "
        "defaults of range, noise and resolution: TDK DS-000347 (ICM-42688-P, 16 g, 16 bits)"
    )

    range: Number = quantity(
        "s_max, largest reading; readings are clipped at +- s_max",
        "m/s^2",
        gt=0,
        le=1e9,
        default=156.9064,
    )
    noise_density: Number = quantity(
        "N, root of the one-sided power spectral density of the noise",
        "(m/s^2)/sqrt(Hz)",
        ge=0,
        le=1e6,
        default=6.864655e-4,
    )
    resolution: Number = quantity(
        "q, resolution, to whose multiples readings are rounded; 0: not rounded",
        "m/s^2",
        ge=0,
        le=1e9,
        default=4.788403e-3,
    )


def steps_per_sample(sample_rate: float, step: float) -> int:
    """Return the number of integration steps of ``step`` [s] between samples.

    Raises
    ------
    ValueError
        The number is not an integer; the message names the nearest rates that fit.
    """
    steps = 1.0 / (sample_rate * step)
    whole = max(1, round(steps))
    if abs(steps - whole) <= RATE_TOLERANCE * whole:
        return whole
    below = int(steps)
    if below == 0:
        nearest = f"the highest rate is {1 / step:.10g} Hz"
    else:
        rates = f"{1 / (below * step):.10g} and {1 / ((below + 1) * step):.10g} Hz"
        nearest = f"the nearest rates that work are {rates}"
    raise ValueError(
        f"sample_rate = {sample_rate:.10g} Hz: must be the integration rate, {1 / step:.10g} Hz "
        f"at solver.step = {step:g} s, divided by a whole number; {nearest}"
    )


NAME = "[a-z][a-z0-9_]{0,63}"


def _name(value: Any) -> Any:
    # The name becomes part of channels' and topics' names, and the frame of messages.
    if not isinstance(value, str) or not re.fullmatch(NAME, value):
        raise ValueError(
            "the name must have at most 64 small letters, digits and _, and begin with a letter"
        )
    if _is_reserved(value):
        raise ValueError(
            f"the name {value} is that of another frame of the drive; choose one that is not "
            "deck, drive_housing, spindle, or race or ball with a number"
        )
    return value


SensorName = Annotated[
    str,
    BeforeValidator(_name),
    InSchema({"allOf": [{"pattern": f"^{NAME}$"}, {"not": {"pattern": f"^({_RESERVED})$"}}]}),
]
_BY_DEFAULT = BeforeValidator(lambda value: {} if value is None else value)
"""Validator that replaces a missing value by a sensor with all defaults."""
Sensors = dict[SensorName, Annotated[Accelerometer, _BY_DEFAULT]]
"""Accelerometers by name; names are free."""


class ProximityProbe(Sampled):
    """Proximity probe on the drive's housing, looking at the deck; it does not act on the dynamics.

    It has two axes across the shaft, and with a deck in space a third along it, with one probe
    each. The probes are fixed and do not turn with the deck.

    It senses the displacement r of a point of the deck from its position with the deck at rest. In
    physical order: r is turned into the probes' axes, white noise is added, a second-order
    Butterworth low-pass follows, then come sampling, range and quantisation, as in an accelerometer
    (``ab_sim.drive.pickup.Pickup``).
    """

    unit: ClassVar[str] = "m"
    equation: ClassVar[str] = (
        "s = q round(clip(B(A(phi) r + n), -s_max, s_max) / q) at t = k / F_s; "
        "|B(F)|^2 = 1 / (1 + (F / F_c)^4), S_n = N^2"
    )
    source: ClassVar[str] = (
        "the standard sampled-data chain; range: eddy-current probes with a linear range of 2 mm; "
        "resolution: 16 bits over the range; noise: assumed"
    )

    position: tuple[Length, Length, Length] = quantity(
        "point of the deck that the probe measures, from C on deck axes; only with a deck in space",
        "m",
        default=(0.0, 0.0, 0.0),
    )
    axis_angle: Number = quantity(
        "phi, first axis from x; the second is pi/2 further",
        "rad",
        ge=-1e3,
        le=1e3,
        default=0.0,
    )
    range: Number = quantity(
        "s_max, largest reading; readings are clipped at +- s_max", "m", gt=0, le=10, default=1e-3
    )
    noise_density: Number = quantity(
        "N, root of the one-sided power spectral density of the noise",
        "m/sqrt(Hz)",
        ge=0,
        le=1.0,
        default=1e-8,
    )
    resolution: Number = quantity(
        "q, resolution, to whose multiples readings are rounded; 0: not rounded",
        "m",
        ge=0,
        le=10,
        default=3.05e-8,
    )


Probes = dict[SensorName, Annotated[ProximityProbe, _BY_DEFAULT]]
"""Probes by name; names are free, except that no sensor may have the same name."""

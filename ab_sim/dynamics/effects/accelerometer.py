"""An accelerometer on the deck."""

from typing import TYPE_CHECKING, Annotated, NamedTuple

from ab_sim.errors import exact
from ab_sim.scene.quantities import Count, Number, quantity
from ab_sim.scene.registry import register

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene

RATE_TOLERANCE = 1e-6
"""Relative: a sample rate written with six digits or so counts as the rate that it means."""


@register(
    "accelerometer",
    equation=(
        "s = q round(clip(B(A(phi) f + n), -s_max, s_max) / q) at t = k / F_s; "
        "|B(F)|^2 = 1 / (1 + (F / F_c)^4), S_n = N^2"
    ),
    source=(
        "parameters as in IEEE Std 2700 and MEMS data sheets; the standard sampled-data chain; "
        "defaults of range, noise and resolution: TDK DS-000347 (ICM-42688-P, 16 g, 16 bits)"
    ),
    acts=False,
)
class Accelerometer(NamedTuple):
    """Two-axis accelerometer on the deck; it reads, and does not act on the dynamics.

    It senses specific force f, acceleration minus gravity. In physical order: f is turned into
    the sensor's axes, white noise is added, a second-order Butterworth low-pass follows, then
    come the sampling, the range and the quantisation (``ab_sim.sensing.Pickup``).

    The planar deck does not turn, so that every place on it reads the same.

    Between integration steps the low-pass sees the force as straight lines. That takes
    (pi F h)^2 / 3 off the amplitude at the frequency F with the step h: at F_c the gain is
    -3.02 dB with F_c h = 1/50, -3.3 dB with 1/10, and nothing is left with 1/2.
    """

    axis_angle: Annotated[
        Number,
        quantity(
            "phi, first axis from the deck's x; the second is pi/2 further", "rad", ge=-1e3, le=1e3
        ),
    ] = 0.0
    range: Annotated[
        Number, quantity("s_max, readings are clipped at +- this", "m/s^2", gt=0, le=1e9)
    ] = 156.9064
    noise_density: Annotated[
        Number,
        quantity("N, root of the noise's one-sided spectrum", "(m/s^2)/sqrt(Hz)", ge=0, le=1e6),
    ] = 6.864655e-4
    bandwidth: Annotated[
        Number, quantity("F_c, where the low-pass is 3 dB down", "Hz", ge=1e-3, le=1e9)
    ] = 100.0
    sample_rate: Annotated[
        Number, quantity("F_s; a whole number of steps per sample", "Hz", ge=1e-3, le=1e9)
    ] = 1000.0
    resolution: Annotated[
        Number, quantity("q, difference of neighbouring readings; 0: none", "m/s^2", ge=0, le=1e9)
    ] = 4.788403e-3
    seed: Annotated[
        Count, quantity("picks the noise; the same seed, the same noise", "1", ge=0, le=10**9)
    ] = 0

    def check_scene(self, scene: "Scene") -> None:
        """Check what does not follow from the parameters alone.

        Raises:
            ValueError: names the key, its value, and what is allowed.
        """
        if self.resolution > self.range:
            raise ValueError(
                f"effects.accelerometer.resolution = {exact(self.resolution)} m/s^2: must be at "
                f"most the range, {exact(self.range)} m/s^2; or 0 for none"
            )
        if scene.accuracy is not None:
            return  # there is no step yet; those that do not suit are not chosen
        step = scene.solver.step
        try:
            steps_per_sample(self.sample_rate, step)
        except ValueError as error:
            raise ValueError(f"effects.accelerometer.{error}") from None
        highest = 0.5 / step
        if self.bandwidth > highest * (1 + RATE_TOLERANCE):
            raise ValueError(
                f"effects.accelerometer.bandwidth = {self.bandwidth:.10g} Hz: must be at most "
                f"half the integration rate, {highest:.10g} Hz at solver.step = {step:g} s; "
                "lower it, or the step"
            )


def steps_per_sample(sample_rate: float, step: float) -> int:
    """How many integration steps of ``step`` [s] there are between samples.

    Raises:
        ValueError: not a whole number; names the nearest rates that work.
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

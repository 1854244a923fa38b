"""Proximity probes next to the deck: they measure its displacement."""

from typing import Annotated, ClassVar

from ab_sim.scene.quantities import Length, Number, quantity
from ab_sim.scene.sensors import BY_DEFAULT, Sampled, SensorName


class ProximityProbe(Sampled):
    """Proximity probe on the drive's housing, looking at the deck; it does not act on the dynamics.

    It has two axes across the shaft, and with a deck in space a third along it, with one probe
    each. The probes are fixed and do not turn with the deck.

    It senses the displacement r of a point of the deck from its position with the deck at rest. In
    physical order: r is turned into the probes' axes, white noise is added, a second-order
    Butterworth low-pass follows, then come sampling, range and quantisation, as in an accelerometer
    (``ab_sim.drive.sensing.Pickup``).
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
        "point of the deck that it measures, from C on deck axes; only with a deck in space",
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
        "q, step between two readings; 0: not rounded", "m", ge=0, le=10, default=3.05e-8
    )


Probes = dict[SensorName, Annotated[ProximityProbe, BY_DEFAULT]]
"""Probes by name; names are free, except that no sensor may have the same name."""

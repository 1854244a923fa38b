"""Text of metrics for tables."""

import math
from collections.abc import Callable
from typing import Any

from ab_sim.analysis.circulation import RAD_PER_S, Circulation
from ab_sim.analysis.metrics.metric import DEFAULT_UNITS, NOTHING, Display, Quantity, Row
from ab_sim.base.presentation import in_one_turn
from ab_sim.scene.units import ShownUnit

ANGLE = Quantity("rad", ShownUnit("deg", 180.0 / math.pi))
SMALL_ANGLE = Quantity("rad", ShownUnit("mrad", 1e3))
ANGULAR_SPEED = Quantity("rad/s", RAD_PER_S)
TORQUE = Quantity("N m", ShownUnit("mN m", 1e3))
VELOCITY = Quantity("m/s", ShownUnit("mm/s", 1e3))


def peak_text(whirl: float, time: float, display: Display) -> str:
    """Return the largest whirl and its time as text."""
    return f"{whirl * display.factor:.4g}{display.suffix}{_length(whirl, display)} at {time:.3f} s"


def final_text(whirl: float, halves: tuple[float, float], settled: bool, display: Display) -> str:
    """Return the final whirl as text, with a note if it has not settled."""
    text = f"{whirl * display.factor:.3g}{display.suffix}{_length(whirl, display)}"
    if not settled:
        first, second = (half * display.factor for half in halves)
        text += (
            f", still {'falling' if second < first else 'rising'} ({first:.3g}, then {second:.3g})"
        )
    return text


def _length(whirl: float, display: Display) -> str:
    """Return a whirl that is shown in e as a length in brackets."""
    if display.unit != "e":
        return ""
    return f" ({1e3 * whirl:.3g} mm)" if whirl >= 1e-4 else f" ({1e6 * whirl:.3g} um)"


def number_text(value: float | None) -> str:
    """Return a number with three digits as text; a dash for None."""
    return NOTHING if value is None else f"{value:.3g}"


def shown_text(value: float | None, quantity: Quantity, display: Display) -> str:
    """Return a number in its displayed unit, with three digits; a dash for None.

    Parameters
    ----------
    value
        Number in the quantity's SI unit.
    quantity
        Quantity of the number.
    display
        Units for display.
    """
    return NOTHING if value is None else f"{value * display.of(quantity).factor:.3g}"


def number_row(label: str, value: Callable[[Any], float | None], quantity: Quantity) -> Row:
    """Return a table row of numbers, with their unit in its head.

    Parameters
    ----------
    label
        Label without the unit.
    value
        Function that takes the number, in SI units, from a run's metrics.
    quantity
        Quantity of the numbers.
    """
    return Row(label, lambda m, display: shown_text(value(m), quantity, display), quantity=quantity)


def phase_text(value: float | None, display: Display) -> str:
    """Return an angle [rad] as text with its displayed unit; a dash for None."""
    return NOTHING if value is None else f"{_angle(value, display, '.0f')} {_unit(display)}"


def speed_text(value: float, display: Display) -> str:
    """Return an angular speed [rad/s] as text with its displayed unit."""
    unit = display.of(ANGULAR_SPEED)
    return f"{value * unit.factor:.4g} {unit.text}"


def _angle(value: float, display: Display, degrees: str) -> str:
    """Return an angle [rad] as text without its unit; ``degrees`` is the format if in degrees."""
    unit = display.of(ANGLE)
    return f"{value * unit.factor:{degrees if unit.text == 'deg' else '.4g'}}"


def _unit(display: Display) -> str:
    """Return the displayed unit of angles."""
    return display.of(ANGLE).text


def seconds_text(value: float | None) -> str:
    """Return a time [s] as text, to hundredths; a dash for None."""
    return NOTHING if value is None else f"{value:.2f} s"


def in_band_text(
    time: float | None, band: float, span: tuple[float, float], display: Display
) -> str:
    """Return the time from which the whirl stays in its band as text.

    Parameters
    ----------
    time
        The time [s]; None if the whirl leaves the band at the end.
    band
        Half-width of the band [m].
    span
        Smallest and largest whirl over the last stretch [m], shown without a time.
    display
        Units for display.
    """
    if time is not None:
        return f"+-{band * display.factor:.2g} {display.unit} from {time:.2f} s"
    least, most = (whirl * display.factor for whirl in span)
    return f"not before the end: {least:.3g} to {most:.3g} {display.unit}"


def passage_text(passed: float | None, balls: int) -> str:
    """Return the time of the first passage opposite the unbalance as text."""
    if not balls:
        return NOTHING
    return "never" if passed is None else f"{passed:.3f} s"


def circulating_text(
    circulating: Circulation | None, balls: int, display: Display = DEFAULT_UNITS
) -> str:
    """Return the circulating balls and their speed as text."""
    return NOTHING if circulating is None else circulating.text(balls, display.of(ANGULAR_SPEED))


def angles_text(
    angles: tuple[float, ...],
    circulating: Circulation | None,
    display: Display = DEFAULT_UNITS,
) -> str:
    """Return the final ball angles [rad] as text, a dash for each ball that circulates."""
    if not angles:
        return NOTHING
    round_ = () if circulating is None else circulating.balls
    if len(round_) == len(angles):
        return "none rests"
    texts = [
        "-" if k in round_ else _angle(in_one_turn(a), display, ".1f") for k, a in enumerate(angles)
    ]
    return f"{', '.join(texts)} {_unit(display)}"

"""Text of metrics for tables."""

import math

from ab_sim.analysis.circulation import Circulation
from ab_sim.analysis.metrics.metric import NOTHING, WhirlScale
from ab_sim.base.conventions import in_one_turn


def peak_text(whirl: float, time: float, scale: WhirlScale) -> str:
    """Return the largest whirl and its time as text."""
    return f"{whirl * scale.factor:.4g}{scale.suffix}{_length(whirl, scale)} at {time:.3f} s"


def final_text(whirl: float, halves: tuple[float, float], settled: bool, scale: WhirlScale) -> str:
    """Return the final whirl as text, with a note if it has not settled."""
    text = f"{whirl * scale.factor:.3g}{scale.suffix}{_length(whirl, scale)}"
    if not settled:
        first, second = (half * scale.factor for half in halves)
        text += (
            f", still {'falling' if second < first else 'rising'} ({first:.3g}, then {second:.3g})"
        )
    return text


def _length(whirl: float, scale: WhirlScale) -> str:
    """Return a whirl that is shown in e as a length in brackets."""
    if scale.unit != "e":
        return ""
    return f" ({1e3 * whirl:.3g} mm)" if whirl >= 1e-4 else f" ({1e6 * whirl:.3g} um)"


def number_text(value: float | None) -> str:
    """Return a number with three digits."""
    return NOTHING if value is None else f"{value:.3g}"


def milli_text(value: float | None) -> str:
    """Return thousandths with three digits."""
    return NOTHING if value is None else f"{1e3 * value:.3g}"


def degrees_text(value: float | None) -> str:
    """Return an angle in whole degrees."""
    return NOTHING if value is None else f"{math.degrees(value):.0f} deg"


def seconds_text(value: float | None) -> str:
    """Return a time in hundredths of a second."""
    return NOTHING if value is None else f"{value:.2f} s"


def in_band_text(
    time: float | None, band: float, span: tuple[float, float], scale: WhirlScale
) -> str:
    """Return the time from which the whirl stays in its band as text."""
    if time is not None:
        return f"+-{band * scale.factor:.2g} {scale.unit} from {time:.2f} s"
    least, most = (whirl * scale.factor for whirl in span)
    return f"not before the end: {least:.3g} to {most:.3g} {scale.unit}"


def passage_text(passed: float | None, balls: int) -> str:
    """Return the time of the first passage opposite the unbalance as text."""
    if not balls:
        return NOTHING
    return "never" if passed is None else f"{passed:.3f} s"


def circulating_text(circulating: Circulation | None, balls: int) -> str:
    """Return the circulating balls and their speed as text."""
    return NOTHING if circulating is None else circulating.text(balls)


def angles_text(angles: tuple[float, ...], circulating: Circulation | None) -> str:
    """Return the final ball angles as text."""
    if not angles:
        return NOTHING
    round_ = () if circulating is None else circulating.balls
    if len(round_) == len(angles):
        return "none rests"
    texts = [
        "-" if k in round_ else f"{math.degrees(in_one_turn(a)):.1f}" for k, a in enumerate(angles)
    ]
    return ", ".join(texts) + " deg"

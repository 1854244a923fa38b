"""Figures of merit in words, for tables."""

import math

from ab_sim.analysis import Merits


def peak_text(merits: Merits, scale: float) -> str:
    """Largest whirl, and when; ``scale`` turns m into the unit."""
    return f"{merits.peak_whirl * scale:.4g} at {merits.peak_time:.3f} s"


def final_text(merits: Merits, scale: float) -> str:
    """Final whirl, or that it is none yet."""
    text = f"{merits.final_whirl * scale:.3g}"
    if merits.changing:
        first, second = (half * scale for half in merits.halves)
        text += f", still changing ({first:.3g}, then {second:.3g})"
    return text


def number_text(value: float | None) -> str:
    """A number in three digits."""
    return "-" if value is None else f"{value:.3g}"


def milli_text(value: float | None) -> str:
    """Thousandths in three digits."""
    return "-" if value is None else f"{1e3 * value:.3g}"


def in_band_text(merits: Merits, scale: float, unit: str) -> str:
    """From when on the whirl stays in its band."""
    if merits.in_band_from is not None:
        return f"+-{merits.band * scale:.2g} {unit} from {merits.in_band_from:.2f} s"
    least, most = (whirl * scale for whirl in merits.span)
    return f"not before the end: {least:.3g} to {most:.3g} {unit}"


def circulating_text(merits: Merits) -> str:
    """Which balls go round the race for ever, and how fast."""
    if merits.circulating is None:
        return "-"
    return merits.circulating.text(len(merits.final_ball_angles))


def passage_text(merits: Merits) -> str:
    """When all balls were opposite the unbalance first."""
    if not merits.final_ball_angles:
        return "-"
    passed = merits.first_passage_of_opposite
    return "never" if passed is None else f"{passed:.3f} s"


def angles_text(merits: Merits) -> str:
    """Where the balls were at the end."""
    angles, circulating = merits.final_ball_angles, merits.circulating
    if not angles:
        return "-"
    round_ = () if circulating is None else circulating.balls
    if len(round_) == len(angles):
        return "none rests"
    texts = ["-" if k in round_ else f"{math.degrees(a):.1f}" for k, a in enumerate(angles)]
    return ", ".join(texts) + " deg"

"""Floquet multipliers in the complex plane, or the largest modulus over a parameter."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ab_sim.analysis.floquet import Followed, Stability
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import in_one_turn
from ab_sim.show.saved import ResultFigure

_COLORS = {"stable": "tab:blue", "unstable": "tab:red", "undecided": "0.45"}
_MARKERS = ("o", "s", "D")
"""Markers of successive solutions."""
_CLOSEST = 1e-3
"""Least half-width of the view around 1."""
_SHADE: dict[str, Any] = {"color": "tab:green", "alpha": 0.13, "lw": 0}


def drawn_multipliers(solutions: Sequence[Stability]) -> ResultFigure:
    """Return the figure of multipliers in the complex plane, with the unit circle.

    Parameters
    ----------
    solutions
        One or more periodic solutions of one scene at one speed.
    """
    figure = ResultFigure(figsize=(11.0, 6.8), layout="constrained")
    first = solutions[0]
    figure.suptitle(f"Multipliers of {first.scene} at {first.speed:g} rad/s", fontsize=13)
    whole, near = figure.subplots(1, 2)
    for axes in (whole, near):
        _draw_plane(axes, solutions)
    far = max(
        1.0, *(float(np.abs(solution.multipliers).max(initial=0.0)) for solution in solutions)
    )
    _frame(whole, 0.0, 1.12 * far)
    whole.set_title("all", fontsize=10)
    _frame(
        near, 1.0, min(1.0, 1.4 * max(_CLOSEST, *(_from_one(solution) for solution in solutions)))
    )
    near.set_title("around 1", fontsize=10)
    figure.legend(
        *whole.get_legend_handles_labels(), loc="outside lower center", fontsize=9,
        title="over one turn of the spindle; stable inside the circle",
        title_fontsize=8,
    )  # fmt: skip
    return figure


def _draw_plane(axes: Axes, solutions: Sequence[Stability]) -> None:
    """Draw the multipliers of all solutions, and the unit circle."""
    # Many points, because the small part of the circle near 1 must look round.
    turn = np.exp(1j * np.linspace(-math.pi, math.pi, 20_001))
    axes.fill(turn.real, turn.imag, zorder=0, **_SHADE)
    axes.plot(turn.real, turn.imag, color="0.3", lw=1.0)
    for marker, solution in zip(_MARKERS, solutions, strict=False):
        multipliers, color = solution.multipliers, _COLORS[solution.verdict]
        label = f"{_name(solution)}: {solution.verdict}, largest {solution.largest:.6g}"
        axes.plot(
            multipliers.real,
            multipliers.imag,
            marker,
            color=color,
            mfc="none",
            ms=6,
            mew=1.4,
            label=label,
        )
    axes.set_aspect("equal")
    axes.grid(alpha=0.3)
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")


def _frame(axes: Axes, center: float, half: float) -> None:
    axes.set_xlim(center - half, center + half)
    axes.set_ylim(-half, half)


def _from_one(stability: Stability) -> float:
    """Return the distance of the multiplier with the largest modulus from 1; at most 1."""
    moduli = np.abs(stability.multipliers)
    largest = stability.multipliers[
        np.abs(moduli - stability.largest) <= 1e-12 * (1.0 + stability.largest)
    ]
    return float(np.abs(largest - 1.0).min(initial=1.0))


def _name(stability: Stability) -> str:
    """Return the name of a solution: its whirl, and the angles of the first balls."""
    what = "deck at rest" if stability.balanced else f"whirl to {1e6 * stability.whirl[1]:.3g} um"
    angles = ", ".join(f"{math.degrees(in_one_turn(angle)):.1f}" for angle in stability.angles[:6])
    more = ", .." if len(stability.angles) > 6 else ""
    return f"{what}, balls at {angles}{more} deg" if angles else what


def drawn_modulus(followed: Followed) -> ResultFigure:
    """Return the figure of the largest modulus over the parameter, with the stable part shaded.

    If the deck moves, the whirl is drawn, too.

    Parameters
    ----------
    followed
        Solutions over the parameter.

    Raises
    ------
    InputError
        No solution was found at any value.
    """
    if all(point.solution is None for point in followed.points):
        raise InputError(f"{followed.key}: no periodic solution was found; there is none to draw")
    figure = ResultFigure(figsize=(9.0, 6.5), layout="constrained")
    figure.suptitle(f"Stability of {followed.scene} over {followed.key}", fontsize=13)
    stabilities = [point.solution for point in followed.points]
    values = [point.value for point in followed.points]
    if all(one is None or one.balanced for one in stabilities):
        below = figure.subplots()
        draw_modulus_curve(below, followed)
    else:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 0.55))
        draw_modulus_curve(above, followed)
        whirl = [math.nan if one is None else 1e6 * one.whirl_max for one in stabilities]
        below.plot(values, whirl, ".-", color="0.25", lw=1.0, ms=4)
        for low, high in stable_parts(followed):
            below.axvspan(low, high, **_SHADE)
        below.set_ylabel("largest whirl [um]")
        below.set_ylim(bottom=0.0)
        below.grid(alpha=0.3)
    below.set_xlabel(followed.key + (" [rad/s]" if followed.key == "speed" else ""))
    below.set_xlim(min(values), max(values))
    return figure


def draw_modulus_curve(axes: Axes, followed: Followed) -> None:
    """Draw the largest modulus of the multipliers over the parameter.

    Borders of stability are marked, and stable ranges are shaded.
    """
    values = np.array([point.value for point in followed.points])
    stabilities = [point.solution for point in followed.points]
    largest = np.array([math.nan if one is None else one.largest for one in stabilities])
    axes.plot(values, largest, color="0.4", lw=1.0, zorder=2)
    for verdict, color in _COLORS.items():
        here = [one is not None and one.verdict == verdict for one in stabilities]
        if any(here):
            axes.plot(values[here], largest[here], ".", color=color, ms=6, zorder=3, label=verdict)
    for low, high in stable_parts(followed):
        axes.axvspan(low, high, **_SHADE)
    for value in values[np.isnan(largest)]:
        axes.axvline(value, color="tab:orange", lw=0.8, ls=":", zorder=1)
    if np.isnan(largest).any():
        axes.plot([], [], color="tab:orange", ls=":", label="none found")
    axes.axhline(1.0, color="0.3", lw=1.0)
    for border in followed.borders:
        axes.plot(border.value, 1.0, "o", color="k", mfc="w", ms=6, zorder=4)
        # On the stable side, because the curve is high on the other one.
        side = -1 if border.stable_below else 1
        axes.annotate(
            f"{border.value:.6g}", (border.value, 1.0), xytext=(5 * side, 6),
            textcoords="offset points", ha="right" if border.stable_below else "left", fontsize=8,
        )  # fmt: skip
    axes.set_ylabel("largest modulus of a multiplier")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="upper right")


def stable_parts(followed: Followed) -> Iterator[tuple[float, float]]:
    """Yield the parameter ranges of stable solutions, from border to border."""
    cuts = sorted(border.value for border in followed.borders)
    for one, other in zip(followed.points[:-1], followed.points[1:], strict=True):
        if one.solution is None or other.solution is None or other.new:
            continue
        low, high = sorted((one.value, other.value))
        inside = [cut for cut in cuts if low < cut < high]
        if one.solution.stable and other.solution.stable:
            yield low, high
        elif inside and (one.solution.stable or other.solution.stable):
            stable = one if one.solution.stable else other
            yield min(stable.value, inside[0]), max(stable.value, inside[0])

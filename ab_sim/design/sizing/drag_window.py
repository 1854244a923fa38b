"""Balls and drags that balance a drive in time without circulation."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating import BunchDrive
from ab_sim.design.sizing.closed_forms import (
    FittingBalls,
    balanced_places,
    balls_of,
    drive_of_balls,
    largest_ball,
    least_mass,
    share_in_time,
)
from ab_sim.design.sizing.specification import DriveSpecification

ABOVE_BORDER = 1.25
"""Start of the window relative to the circulation border.

At the border a bunch separates extremely slowly, and its closed form has an error of 2 %.
"""
_HEAVIER = (1.02, 1.1, 1.2, 1.35, 1.5, 2.0)
"""Ball masses to be tried, relative to the least mass that balances the largest unbalance.

At 1 the slowest growth rate of a balanced position is 0, and nothing settles.
"""
_ROOMY, _AS_WIDE = 2.0, 0.9
"""Factors for the sufficient width of a drag window; the lightest balls that have it are chosen.

The window must be ``_ROOMY`` times as wide as the drag's tolerance, or have ``_AS_WIDE`` times the
logarithmic width of the widest window.
"""
SPAN = 300.0
"""Largest factor between a searched drag and the circulation border, above or below."""
_LOOKS = 36
"""Number of drags at which the share is computed."""
_BISECTIONS = 10
"""Number of bisections of an end of the window."""
_LEAST_RATIO = 1.05
"""Least ratio of highest to lowest drag of a window."""


class DragWindow(NamedTuple):
    """Drags [N s/m] with which enough drives are balanced in time."""

    low: float
    high: float
    """Limits of the window [N s/m], ``low`` and ``high``."""
    low_end: str
    """Reason of the lower limit: circulation, or too slow."""

    @property
    def ratio(self) -> float:
        """Ratio high / low."""
        return self.high / self.low


@dataclass(frozen=True)
class SizedBalls:
    """Equal balls with their number and properties, or the reason why they are unsuitable."""

    balls: FittingBalls | None
    """Balls; None if none fit."""
    count: int
    """Number of balls n."""
    heavier: float
    """Ball mass relative to the least mass that balances the largest unbalance."""
    border: float
    """Drag above which no bunch of all balls circulates at the running speed [N s/m]."""
    window: DragWindow | None
    """Drags with which enough drives balance in time; None if there are none."""
    drag: float | None
    """Chosen drag [N s/m]: the geometric mean of the window's limits."""
    predicted: float
    """Predicted share of drives balanced in time at ``drag``; if it is None, the largest share."""
    reason_unsuitable: str | None
    """Reason why the balls are unsuitable, and the remedy; None if they are suitable."""

    def report(self) -> dict[str, Any]:
        """Return the balls as JSON-able values in SI units."""
        balls, window = self.balls, self.window
        return {
            "balls": self.count,
            "mass": None if balls is None else balls.mass,
            "radius": None if balls is None else balls.radius,
            "path_radius": None if balls is None else balls.path_radius,
            "balances": None if balls is None else balls.in_a_row,
            "heavier": None if balls is None else self.heavier,
            "circulation_border": None if balls is None else self.border,
            "drag_low": None if window is None else window.low,
            "drag_high": None if window is None else window.high,
            "drag_low_end": None if window is None else window.low_end,
            "drag": self.drag,
            "predicted_share": self.predicted,
            "reason_unsuitable": self.reason_unsuitable,
        }


def sized_balls(count: int, specification: DriveSpecification) -> SizedBalls:
    """Return the lightest ``count`` balls with a sufficient drag window.

    If circulation limits the window below, both limits grow with the square of the ball mass.
    Heavier balls then have no wider window, and cause more whirl at the critical speed.

    Parameters
    ----------
    count
        Number of balls n.
    specification
        Requirements of the balancer.
    """
    least = least_mass(count, specification.largest_unbalance, specification)
    most = largest_ball(count, specification)
    if least is None or _HEAVIER[0] * least > most:
        return SizedBalls(None, count, 1.0, 0.0, None, None, 0.0, _too_large(count, specification))
    candidates = [
        _with_window(balls_of(count, factor * least, specification), factor, specification)
        for factor in _HEAVIER
        if factor * least <= most
    ]
    widths = [
        0.0 if candidate.window is None else math.log(candidate.window.ratio)
        for candidate in candidates
    ]
    if not any(widths):
        return max(candidates, key=lambda candidate: candidate.predicted)
    wide = min(_AS_WIDE * max(widths), math.log(_ROOMY * _least_ratio(specification)))
    return next(
        candidate for candidate, width in zip(candidates, widths, strict=True) if width >= wide
    )


def _least_ratio(specification: DriveSpecification) -> float:
    """Return the ratio of highest to lowest drag that the drag's tolerance requires."""
    return (1.0 + specification.drag_tolerance) / (1.0 - specification.drag_tolerance)


def circulation_border(drive: BunchDrive, speed: float) -> float:
    """Return the drag c_b up to which all balls can circulate in a bunch at a speed [N s/m].

    It is n m^2 w_n^3 / (c (w - w_n)) with w_n = sqrt(k/M): the balls of a bunch that turns at w_n
    separate. A fold lies just beyond. For fewer balls the border is lower if the others only add to
    the deck's mass.

    Parameters
    ----------
    drive
        Parameters of the drive; its drag is ignored.
    speed
        Spindle speed w [rad/s], above w_n.
    """
    critical = math.sqrt(drive.stiffness / drive.mass)
    driven = drive.balls * drive.ball_mass**2 * critical**3
    return driven / (drive.damping * (speed - critical))


def predicted_share(balls: FittingBalls, specification: DriveSpecification, drag: float) -> float:
    """Return the share of drives balanced in time at a drag [N s/m], ignoring circulation."""
    places = balanced_places(balls, specification)
    return share_in_time(drive_of_balls(balls, specification, drag), specification, places)


def _with_window(
    balls: FittingBalls, factor: float, specification: DriveSpecification
) -> SizedBalls:
    """Return balls with their drag window.

    Parameters
    ----------
    balls
        Balls on the race.
    factor
        Their mass relative to the least mass that balances the largest unbalance.
    specification
        Requirements of the balancer.
    """
    places = balanced_places(balls, specification)
    border = circulation_border(drive_of_balls(balls, specification, 1.0), specification.speed)

    def share(drag: float) -> float:
        return share_in_time(drive_of_balls(balls, specification, drag), specification, places)

    drags = border * np.geomspace(1.0 / SPAN, SPAN, _LOOKS)
    drags = np.union1d(drags, [ABOVE_BORDER * border])
    shares = np.array([share(drag) for drag in drags.tolist()])
    above = drags >= ABOVE_BORDER * border
    window = _widest_window(share, specification.share, drags[above], shares[above])
    drag = None if window is None else math.sqrt(window.low * window.high)
    predicted = float(shares[above].max()) if drag is None else share(drag)
    why = None
    if window is None:
        why = _no_window(float(shares.max()), predicted, specification)
    elif window.ratio < _least_ratio(specification):
        why = (
            f"the tolerance of the drag, {100 * specification.drag_tolerance:g} %, exceeds the "
            "width of the drag window; reduce the tolerance, or allow more time to settle"
        )
    return SizedBalls(balls, balls.count, factor, border, window, drag, predicted, why)


def _widest_window(
    share: Callable[[float], float], wanted: float, drags: np.ndarray, shares: np.ndarray
) -> DragWindow | None:
    """Return the widest range of drags with the wanted share, from ``drags[0]`` on.

    Parameters
    ----------
    share
        Function from a drag to the share balanced in time.
    wanted
        Required share.
    drags
        Drags at which the shares are known, rising.
    shares
        Their shares.
    """
    best: DragWindow | None = None
    for first, last in _stretches(shares >= wanted):
        low, high = float(drags[first]), float(drags[last])
        if first > 0:
            low = _edge(share, wanted, low, float(drags[first - 1]))
        if last + 1 < len(drags):
            high = _edge(share, wanted, high, float(drags[last + 1]))
        window = DragWindow(low, high, "too slow" if first > 0 else "circulation")
        if window.ratio >= _LEAST_RATIO and (best is None or window.ratio > best.ratio):
            best = window
    return best


def _stretches(inside: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield the first and the last index of each stretch of True."""
    edges = np.diff(inside.astype(int), prepend=0, append=0)
    yield from zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0) - 1, strict=True)


def _edge(share: Callable[[float], float], wanted: float, inside: float, outside: float) -> float:
    """Return the end of a window by bisection of the logarithm of the drag [N s/m].

    Parameters
    ----------
    share
        Function from a drag to the share balanced in time.
    wanted
        Required share.
    inside
        Drag with the required share [N s/m].
    outside
        Drag without it [N s/m].
    """
    for _ in range(_BISECTIONS):
        middle = math.sqrt(inside * outside)
        if share(middle) >= wanted:
            inside = middle
        else:
            outside = middle
    return inside


def _too_large(count: int, specification: DriveSpecification) -> str:
    """Return the reason for a number of balls that cannot balance the largest unbalance."""
    most = balls_of(count, largest_ball(count, specification), specification)
    return (
        f"the largest {count} balls that fit, {2e3 * most.radius:.3g} mm wide, balance "
        f"{most.in_a_row:.3g} of {specification.largest_unbalance:.3g} kg m; use a wider or larger "
        "race, more balls or denser ones"
    )


def _no_window(best: float, above: float, specification: DriveSpecification) -> str:
    """Return the reason for balls without a drag window.

    Parameters
    ----------
    best
        Largest share at any drag.
    above
        Largest share at drags without circulation.
    specification
        Requirements of the balancer.
    """
    wanted = 100 * specification.share
    if best >= specification.share:
        return (
            f"at the low drags at which {wanted:g} % of drives are balanced in time, balls "
            "circulate; damp the suspension more, allow more time to settle, or run faster"
        )
    return (
        f"at no drag {wanted:g} % of drives are balanced in time, at most {100 * above:.0f} %; "
        "allow more time to settle or more residual unbalance, damp the suspension more, or use "
        "more balls"
    )

"""Balls and the drag with which they balance a drive in time and do not circulate."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating import BunchDrive, reach_over_drag
from ab_sim.design.sizing.race_fit import FittingBalls, balls_of, largest_ball, least_mass
from ab_sim.design.sizing.settle_time import (
    BalancedPlaces,
    balanced_places,
    drive_of_balls,
    share_in_time,
)
from ab_sim.design.sizing.specification import DriveSpecification

ABOVE_BORDER = 1.25
"""The window begins so far above the border of circulation: there a bunch takes for ever to part,
and the closed form of the border is good to 2 %."""
HEAVIER = (1.02, 1.1, 1.2, 1.35, 1.5, 2.0)
"""Masses that are looked at, in the least one that balances the largest unbalance. At 1 the
slowest growth rate of a balanced position is 0, and nothing settles."""
ROOMY, AS_WIDE = 2.0, 0.9
"""The lightest balls are taken whose window is so many times wider than the drag's tolerance takes;
or, if there are none, so wide as the widest, in the logarithm."""
SPAN = 300.0
"""Drags are looked at up to so many times the border."""
LOOKS = 36
BISECTIONS = 10
LEAST_RATIO = 1.05
"""A narrower window, highest over lowest drag, is none."""


class DragWindow(NamedTuple):
    """Drags [N s/m] with which enough drives are balanced in time."""

    low: float
    high: float
    low_end: str
    """What ends it below: circulation, or too slow."""

    @property
    def ratio(self) -> float:
        """high / low."""
        return self.high / self.low


@dataclass(frozen=True)
class SizedBalls:
    """Balls of one number, and what follows from them; ``why_not`` where they do not serve."""

    balls: FittingBalls | None
    """None: none fit."""
    count: int
    heavier: float
    """Their mass in the least one that balances the largest unbalance."""
    border: float
    """Drag above which no bunch of all balls circulates at the running speed [N s/m]."""
    window: DragWindow | None
    drag: float | None
    """The one to take [N s/m], in the middle of the window, in the logarithm."""
    predicted: float
    """Share of drives that is balanced in time at that drag; without one the largest at any."""
    why_not: str | None
    """And what to change."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values, SI units."""
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
            "why_not": self.why_not,
        }


def sized_balls(count: int, specification: DriveSpecification) -> SizedBalls:
    """The lightest balls of a number whose drag window is wide enough, or about as wide as any.

    Where circulation ends the window below, both ends grow with the balls' mass squared, and
    heavier balls get no wider one; they make more whirl on the way through the critical speed.

    Args:
        count: n.
        specification: what they must do.
    """
    least = least_mass(count, specification.largest_unbalance, specification)
    if least is None:
        return SizedBalls(None, count, 1.0, 0.0, None, None, 0.0, _too_large(count, specification))
    most = largest_ball(count, specification)
    found = [
        _with_window(balls_of(count, factor * least, specification), factor, specification)
        for factor in HEAVIER
        if factor * least <= most
    ]
    if not found:
        return SizedBalls(None, count, 1.0, 0.0, None, None, 0.0, _too_large(count, specification))
    widths = [0.0 if each.window is None else math.log(each.window.ratio) for each in found]
    if not any(widths):
        return max(found, key=lambda each: each.predicted)
    wide = min(AS_WIDE * max(widths), math.log(ROOMY * least_ratio(specification)))
    return next(each for each, width in zip(found, widths, strict=True) if width >= wide)


def least_ratio(specification: DriveSpecification) -> float:
    """Highest over lowest drag that a window must have for the drag's tolerance."""
    return (1.0 + specification.drag_tolerance) / (1.0 - specification.drag_tolerance)


def circulation_border(drive: BunchDrive, speed: float) -> float:
    """c_b up to which all balls can circulate in a bunch at a speed [N s/m].

    n m^2 w_n^3 / (c (w - w_n)), w_n = sqrt(k/M): where the bunch turns at w_n its balls part. A
    fold is just beyond, and of fewer balls the border lies lower where the rest only add to the
    deck's mass.

    Args:
        drive: the numbers; the drag does not matter.
        speed: w [rad/s], above w_n.
    """
    critical = math.sqrt(drive.stiffness / drive.mass)
    driven = drive.balls * drive.ball_mass**2 * critical**3
    return driven / (drive.damping * (speed - critical))


def predicted_share(balls: FittingBalls, specification: DriveSpecification, drag: float) -> float:
    """Share of drives that is balanced in time at a drag [N s/m], circulation left aside."""
    places = balanced_places(balls, specification)
    return share_in_time(drive_of_balls(balls, specification, drag), specification, places)


def known_borders(drive: BunchDrive, speed: float) -> dict[int, float]:
    """Largest drag at which a stable bunch is known by its number of balls [N s/m].

    Args:
        drive: the numbers.
        speed: w [rad/s].
    """
    found = {}
    start = drive._replace(drag=circulation_border(drive, speed))
    for count in range(1, drive.balls + 1):
        reaches = reach_over_drag(start, speed, count)
        if reaches:
            found[count] = max(each.high for each in reaches)
    return found


def _with_window(
    balls: FittingBalls, factor: float, specification: DriveSpecification
) -> SizedBalls:
    places = balanced_places(balls, specification)
    border = circulation_border(drive_of_balls(balls, specification, 1.0), specification.speed)
    search = _Search(balls, specification, places)
    drags = border * np.geomspace(1.0 / SPAN, SPAN, LOOKS)
    drags = np.union1d(drags, [ABOVE_BORDER * border])
    shares = np.array([search.share(drag) for drag in drags.tolist()])
    window = search.window(drags, shares, ABOVE_BORDER * border)
    drag = None if window is None else math.sqrt(window.low * window.high)
    above = drags >= ABOVE_BORDER * border
    predicted = float(shares[above].max()) if drag is None else search.share(drag)
    why = None
    if window is None:
        why = _no_window(float(shares.max()), predicted, specification)
    elif window.ratio < least_ratio(specification):
        why = (
            f"the drag of built drives is off by {100 * specification.drag_tolerance:g} %, more "
            "than the window is wide; hold the drag closer, or give more time to settle"
        )
    return SizedBalls(balls, balls.count, factor, border, window, drag, predicted, why)


class _Search:
    """Where the share of drives that is balanced in time crosses what is wanted."""

    def __init__(
        self, balls: FittingBalls, specification: DriveSpecification, places: BalancedPlaces
    ) -> None:
        self._balls, self._specification, self._places = balls, specification, places

    def share(self, drag: float) -> float:
        drive = drive_of_balls(self._balls, self._specification, drag)
        return share_in_time(drive, self._specification, self._places)

    def window(self, drags: np.ndarray, shares: np.ndarray, floor: float) -> DragWindow | None:
        """The widest range above a floor in which the share is at least what is wanted."""
        inside = (shares >= self._specification.share) & (drags >= floor)
        best: DragWindow | None = None
        k = 0
        while k < len(drags):
            if not inside[k]:
                k += 1
                continue
            first = k
            while k + 1 < len(drags) and inside[k + 1]:
                k += 1
            low, high = float(drags[first]), float(drags[k])
            ends_below = low > floor
            if ends_below:
                low = self._edge(low, max(float(drags[first - 1]), floor))
            if k + 1 < len(drags):
                high = self._edge(high, float(drags[k + 1]))
            found = DragWindow(low, high, "too slow" if ends_below else "circulation")
            if found.ratio >= LEAST_RATIO and (best is None or found.ratio > best.ratio):
                best = found
            k += 1
        return best

    def _edge(self, inside: float, outside: float) -> float:
        for _ in range(BISECTIONS):
            middle = math.sqrt(inside * outside)
            if self.share(middle) >= self._specification.share:
                inside = middle
            else:
                outside = middle
        return inside


def _too_large(count: int, specification: DriveSpecification) -> str:
    most = balls_of(count, largest_ball(count, specification), specification)
    return (
        f"the largest {count} balls that fit, {2e3 * most.radius:.3g} mm wide, balance "
        f"{most.in_a_row:.3g} kg m of {specification.largest_unbalance:.3g}; take a wider or "
        "larger race, more balls or denser ones"
    )


def _no_window(best: float, above: float, specification: DriveSpecification) -> str:
    wanted = 100 * specification.share
    if best >= specification.share:
        return (
            f"with so little drag that {wanted:g} % are in time balls circulate; damp the "
            "suspension more, give more time to settle, or run faster"
        )
    return (
        f"at no drag {wanted:g} % are in time, at most {100 * above:.0f} %; give more time to "
        "settle, leave more unbalance, damp the suspension more, or take more balls"
    )

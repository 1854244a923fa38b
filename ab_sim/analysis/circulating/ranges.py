"""Ranges of speed and drag in which balls can circulate in a bunch, and their limits."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating.bunch import BunchDrive, CirculatingBunch, bunches, stalled
from ab_sim.analysis.held_speed import FASTEST

FOLD, UNSTABLE, LARGE_SWING, SEARCH_END = "fold", "unstable", "swings", "end of the range"
"""Limits of a range.

``FOLD``: the state meets an unstable one. ``UNSTABLE``: it loses stability. ``LARGE_SWING``: swings
become too large for the closed form. ``SEARCH_END``: the range of the search ends.
"""
_LOOKS = 160
"""Number of parameter values at which a bunch is sought; narrower ranges can be missed."""
_SAME = 1e-3
"""Relative difference of speed beyond which two bunches count as different."""
_BISECTIONS = 60
"""Largest number of bisections of a limit; 60 reach neighbouring floating-point numbers."""


class BunchRange(NamedTuple):
    """Range of a parameter with a stable circulating bunch."""

    balls: int
    """Number of circulating balls."""
    low: float
    high: float
    """Limits of the range, ``low`` and ``high``: speed [rad/s] or drag [N s/m]."""
    low_end: str
    high_end: str
    """Reason of each limit: ``FOLD``, ``UNSTABLE``, ``LARGE_SWING`` or ``SEARCH_END``."""
    low_speed: float
    high_speed: float
    """Speed s of the bunch at each limit [rad/s]."""

    def report(self) -> dict[str, Any]:
        """Return the range as JSON-able values."""
        return self._asdict()


def speed_ranges(drive: BunchDrive, count: int, also: Sequence[float] = ()) -> list[BunchRange]:
    """Return the ranges of spindle speed [rad/s] in which a stable bunch exists.

    The search is from a tenth of the critical speed to 1e5 rad/s.

    Parameters
    ----------
    drive
        Parameters of the drive.
    count
        Number of balls in the bunch, from 1 to the number of balls.
    also
        Further spindle speeds [rad/s] at which the bunch is sought.
    """
    critical = math.sqrt(drive.stiffness / drive.mass)
    values = np.geomspace(0.1 * critical, max(FASTEST, critical), _LOOKS)
    values = np.union1d(values, [abs(value) for value in also if value])
    return _ranges(lambda w: (drive, w), count, values)


def drag_ranges(drive: BunchDrive, speed: float, count: int) -> list[BunchRange]:
    """Return the ranges of the drag on a ball [N s/m] in which a stable bunch exists.

    The search is from 1/1000 to 1000 times the drive's drag.

    Parameters
    ----------
    drive
        Parameters of the drive.
    speed
        Spindle speed w [rad/s], not 0.
    count
        Number of balls in the bunch, from 1 to the number of balls.
    """
    values = np.union1d(drive.drag * np.geomspace(1e-3, 1e3, _LOOKS), [drive.drag])
    return _ranges(lambda drag: (drive._replace(drag=drag), abs(speed)), count, values)


Case = Callable[[float], tuple[BunchDrive, float]]
"""Function that returns drive and spindle speed [rad/s] at a value of the parameter."""


def _ranges(case: Case, count: int, values: np.ndarray) -> list[BunchRange]:
    """Return the ranges of a parameter with a stable bunch, between rising values."""
    exists = [stalled(*case(float(value)), count) is not None for value in values]
    ranges, k = [], 0
    while k < len(values):
        if not exists[k]:
            k += 1
            continue
        first = k
        while k + 1 < len(values) and exists[k + 1]:
            k += 1
        before = float(values[first - 1]) if first else None
        after = float(values[k + 1]) if k + 1 < len(values) else None
        low, low_end, low_speed = _end(case, count, float(values[first]), before)
        high, high_end, high_speed = _end(case, count, float(values[k]), after)
        ranges.append(BunchRange(count, low, high, low_end, high_end, low_speed, high_speed))
        k += 1
    return ranges


def _end(case: Case, count: int, inside: float, outside: float | None) -> tuple[float, str, float]:
    """Locate the limit of a range by bisection.

    Parameters
    ----------
    case
        Function of the parameter's value.
    count
        Number of balls in the bunch.
    inside
        Value with a stable bunch.
    outside
        Neighbouring value without one; None at the end of the search.

    Returns
    -------
    tuple[float, str, float]
        Value at the limit, its reason, and the speed s of the bunch there [rad/s].
    """
    if outside is None:
        return inside, SEARCH_END, _speed(stalled(*case(inside), count))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            break
        if stalled(*case(middle), count) is None:
            outside = middle
        else:
            inside = middle
    speed = _speed(stalled(*case(inside), count))
    # A bunch at nearly the same speed just outside has lost its stability, or the swings are too
    # large there. Without any, the bunch has ended in a fold.
    beyond = bunches(*case(outside), count)
    near = [state for state in beyond if abs(state.speed - speed) <= _SAME * speed]
    if not near:
        return inside, FOLD, speed
    return inside, LARGE_SWING if not near[0].valid else UNSTABLE, speed


def _speed(state: CirculatingBunch | None) -> float:
    """Return the speed s of a bunch that is known to exist [rad/s]."""
    assert state is not None
    return state.speed

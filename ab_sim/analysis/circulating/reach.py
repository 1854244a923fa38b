"""Ranges of speed and drag in which balls can circulate in a bunch, and their limits."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating.bunch import BunchDrive, CirculatingBunch, bunches, stalled
from ab_sim.analysis.held_speed import FASTEST

FOLD, UNSTABLE, SWING, END = "fold", "unstable", "swings", "end of the range"
"""Limits of a range.

``FOLD``: the state meets an unstable one. ``UNSTABLE``: it loses stability. ``SWING``: swings
become too large for the closed form. ``END``: the range of the search ends.
"""
LOOKS = 160
"""Number of parameter values at which the state is sought."""
SAME = 1e-3
"""Relative difference of speed beyond which two states count as different."""
BISECTIONS = 60


class Reach(NamedTuple):
    """Range of a parameter with a stable circulating bunch."""

    balls: int
    """Number of circulating balls."""
    low: float
    high: float
    """Limits of the range in SI units, ``low`` and ``high``."""
    low_end: str
    high_end: str
    """Reason of each limit: fold, unstable, swings, or end of the range."""
    low_speed: float
    high_speed: float
    """Speed s of the bunch at each limit [rad/s]."""

    def report(self) -> dict[str, Any]:
        """Return the range as JSON-able values."""
        return self._asdict()


def reach_over_speed(drive: BunchDrive, count: int, also: Sequence[float] = ()) -> list[Reach]:
    """Return ranges of spindle speed [rad/s], searched from a tenth of the critical speed to 1e5.

    Args:
        drive: parameters of the drive.
        count: number of balls in the bunch, from 1 to the number of balls.
        also: further speeds at which the state is sought.
    """
    critical = math.sqrt(drive.stiffness / drive.mass)
    values = np.geomspace(0.1 * critical, max(FASTEST, critical), LOOKS)
    values = np.union1d(values, [abs(value) for value in also if value])
    return _reach(lambda w: (drive, w), count, values)


def reach_over_drag(drive: BunchDrive, speed: float, count: int) -> list[Reach]:
    """Return ranges of the drag on a ball [N s/m], from 1/1000 to 1000 times the drive's.

    Args:
        drive: parameters of the drive.
        speed: spindle speed w [rad/s], not 0.
        count: number of balls in the bunch, from 1 to the number of balls.
    """
    values = np.union1d(drive.drag * np.geomspace(1e-3, 1e3, LOOKS), [drive.drag])
    return _reach(lambda drag: (drive._replace(drag=drag), abs(speed)), count, values)


Case = Callable[[float], tuple[BunchDrive, float]]
"""Function that returns drive and spindle speed [rad/s] at a value of the parameter."""


def _reach(case: Case, count: int, values: np.ndarray) -> list[Reach]:
    there = [stalled(*case(float(value)), count) is not None for value in values]
    reaches, k = [], 0
    while k < len(values):
        if not there[k]:
            k += 1
            continue
        first = k
        while k + 1 < len(values) and there[k + 1]:
            k += 1
        before = float(values[first - 1]) if first else None
        after = float(values[k + 1]) if k + 1 < len(values) else None
        low, low_end, low_speed = _end(case, count, float(values[first]), before)
        high, high_end, high_speed = _end(case, count, float(values[k]), after)
        reaches.append(Reach(count, low, high, low_end, high_end, low_speed, high_speed))
        k += 1
    return reaches


def _end(case: Case, count: int, inside: float, outside: float | None) -> tuple[float, str, float]:
    """Return a limit of the state, its reason and the speed there, by bisection."""
    if outside is None:
        return inside, END, _speed(stalled(*case(inside), count))
    for _ in range(BISECTIONS):
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            break
        if stalled(*case(middle), count) is None:
            outside = middle
        else:
            inside = middle
    speed = _speed(stalled(*case(inside), count))
    beyond = bunches(*case(outside), count)
    near = [state for state in beyond if abs(state.speed - speed) <= SAME * speed]
    if not near:
        return inside, FOLD, speed
    return inside, SWING if not near[0].known else UNSTABLE, speed


def _speed(state: CirculatingBunch | None) -> float:
    assert state is not None
    return state.speed

"""Over which speeds, and which drags, balls can circulate in a bunch, and what ends it there."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating.bunch import CirculatingBunch, bunches, stalled
from ab_sim.analysis.circulating.drive import BunchDrive
from ab_sim.analysis.held_speed import FASTEST

FOLD, UNSTABLE, SWING, END = "fold", "unstable", "swings", "end of the range"
"""What ends a range: the state meets an unstable one; it loses its stability; swings become so
large that it is not known any more; nothing that was looked at."""
LOOKS = 160
"""Values of a parameter at which it is looked for the state."""
SAME = 1e-3
"""Share of its speed that a state changes by, beyond which it is another one."""
BISECTIONS = 60


class Reach(NamedTuple):
    """A range of a parameter in which a stable circulating bunch is known."""

    balls: int
    """How many circulate."""
    low: float
    high: float
    """SI."""
    low_end: str
    high_end: str
    """fold, unstable, swings, or end of the range."""
    low_speed: float
    high_speed: float
    """s of the bunch at either end [rad/s]."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return self._asdict()


def reach_over_speed(drive: BunchDrive, count: int, also: Sequence[float] = ()) -> list[Reach]:
    """Ranges of the spindle's speed [rad/s], above 0, from a tenth of the critical one to 1e5.

    Args:
        drive: the numbers.
        count: balls in the bunch, from 1 to ``drive.balls``.
        also: further speeds at which it is looked for.
    """
    critical = math.sqrt(drive.stiffness / drive.mass)
    values = np.geomspace(0.1 * critical, max(FASTEST, critical), LOOKS)
    values = np.union1d(values, [abs(value) for value in also if value])
    return _reach(lambda w: (drive, w), count, values)


def reach_over_drag(drive: BunchDrive, speed: float, count: int) -> list[Reach]:
    """Ranges of the drag on a ball [N s/m], from 1/1000 to 1000 times the drive's.

    Args:
        drive: the numbers.
        speed: w [rad/s], not 0.
        count: balls in the bunch, from 1 to ``drive.balls``.
    """
    values = np.union1d(drive.drag * np.geomspace(1e-3, 1e3, LOOKS), [drive.drag])
    return _reach(lambda drag: (drive._replace(drag=drag), abs(speed)), count, values)


Case = Callable[[float], tuple[BunchDrive, float]]
"""Drive and spindle speed [rad/s] at a value of the parameter."""


def _reach(case: Case, count: int, values: np.ndarray) -> list[Reach]:
    there = [stalled(*case(float(value)), count) is not None for value in values]
    found, k = [], 0
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
        found.append(Reach(count, low, high, low_end, high_end, low_speed, high_speed))
        k += 1
    return found


def _end(case: Case, count: int, inside: float, outside: float | None) -> tuple[float, str, float]:
    """Where the state ends between a value that has it and one that has not; why; and its speed."""
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
    near = [each for each in beyond if abs(each.speed - speed) <= SAME * speed]
    if not near:
        return inside, FOLD, speed
    return inside, SWING if not near[0].known else UNSTABLE, speed


def _speed(state: CirculatingBunch | None) -> float:
    assert state is not None
    return state.speed

"""Up to which speed, drag or other value balls circulate, exactly: the end of a stable branch.

The branch is followed over s, the mean speed of the bunch, over which it has no folds: what the
parameter's value is follows from s. It ends where a multiplier leaves the unit circle: at a fold,
where the value turns back, or where the bunch parts.

Source: Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 6.1 (continuation), 3.4.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

from scipy.optimize import brentq

from ab_sim.analysis.floquet.circulating import Case, CirculatingSolution, solution_at

STEP = 0.01
"""Share of s, from one solution to the next."""
MOST_STEPS = 200
DIGITS = 1e-9
"""Share of s at a border that it is located to."""
FLAT_SLOPE = 1e-2
"""d log value / d log s, below which a border is a fold."""
BESIDE = 1e-4
"""Share of s that the slope is taken over."""


class CirculationBorder(NamedTuple):
    """Where balls cease to circulate stably."""

    value: float
    """Of the parameter."""
    spindle_speed: float
    """w [rad/s]."""
    speed: float
    """s of the bunch [rad/s]."""
    fold: bool
    """Whether the solution ceases to exist beyond; otherwise it goes on, unstable."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return self._asdict()


def circulation_border(
    case: Case, start: CirculatingSolution, faster: bool = True
) -> CirculationBorder | None:
    """Where the branch of a stable solution ends; None where it is lost, or goes on for long.

    Args:
        case: what the parameter means.
        start: a stable solution, of ``case(start.value)``.
        faster: towards larger |s|, up to the critical speed; otherwise towards smaller.

    Raises:
        ValueError: the solution is not stable.
        SceneError, InputError: see ``solution_at``.
    """
    if not start.stable:
        raise ValueError("start: must be stable")
    ratio = 1.0 + (STEP if faster else -STEP)
    before, here = None, start
    for _ in range(MOST_STEPS):
        ahead = _found(case, before, here, here.speed * ratio)
        if ahead is None:
            return None
        if not ahead.stable:
            return _located(case, here, ahead)
        before, here = here, ahead
    return None


def _found(
    case: Case, before: CirculatingSolution | None, here: CirculatingSolution, speed: float
) -> CirculatingSolution | None:
    """At a speed of the bunch, where the last two point to."""
    near = here
    if before is not None:
        share = (speed - here.speed) / (here.speed - before.speed)
        near = replace(
            here,
            value=here.value + share * (here.value - before.value),
            states=here.states + share * (here.states - before.states),
        )
    return solution_at(case, near, speed)


def _located(
    case: Case, one: CirculatingSolution, other: CirculatingSolution
) -> CirculationBorder | None:
    """Where between two solutions the largest modulus is 1."""

    def at(speed: float) -> CirculatingSolution:
        found = _found(case, one, other, speed)
        if found is None:
            raise _LostBranch
        return found

    try:
        ends = one.speed, other.speed
        xtol = DIGITS * abs(one.speed)
        speed = float(brentq(lambda s: at(s).largest - 1.0, *ends, xtol=xtol))
        found = at(speed)
        beside = at(speed * (1.0 - BESIDE)), at(speed * (1.0 + BESIDE))
    except _LostBranch:
        return None
    slope = math.log(beside[1].value / beside[0].value) / (2.0 * BESIDE)
    return CirculationBorder(found.value, found.spindle_speed, speed, abs(slope) < FLAT_SLOPE)


class _LostBranch(Exception):
    """No solution was found between two that there are."""

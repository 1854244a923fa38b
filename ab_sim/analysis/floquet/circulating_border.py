"""Limit of a parameter up to which balls circulate: the end of a stable branch.

The branch is followed over the mean bunch speed s, because it has no folds over s; the value of the
parameter follows. The stable branch ends where a multiplier leaves the unit circle. This is a fold,
where the value turns back, or the point where the bunch separates.

Source: Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 6.1 (continuation), 3.4.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

from scipy.optimize import brentq

from ab_sim.analysis.floquet.circulating import Case, CirculatingSolution, solution_at

STEP = 0.01
"""Relative change of s from one solution to the next."""
MOST_STEPS = 200
DIGITS = 1e-9
"""Relative tolerance of s at a border."""
FLAT_SLOPE = 1e-2
"""Slope d log value / d log s below which a border is a fold."""
BESIDE = 1e-4
"""Relative change of s for the difference quotient of the slope."""


class CirculationBorder(NamedTuple):
    """Limit of stable circulation."""

    value: float
    """Value of the parameter."""
    spindle_speed: float
    """Spindle speed w [rad/s]."""
    speed: float
    """Bunch speed s [rad/s]."""
    fold: bool
    """True at a fold, where the solution ends; otherwise the solution becomes unstable."""

    def report(self) -> dict[str, Any]:
        """Return the border as JSON-able values."""
        return self._asdict()


def circulation_border(
    case: Case, start: CirculatingSolution, faster: bool = True
) -> CirculationBorder | None:
    """Return the end of a stable branch; None if it is lost or needs over ``MOST_STEPS`` steps.

    Args:
        case: function that applies the parameter.
        start: stable solution for ``case(start.value)``.
        faster: follow towards larger |s|, up to the critical speed; otherwise towards smaller.

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
    """Return the solution at a bunch speed, from a linear extrapolation of the last two."""
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
    """Locate the border between two solutions, where the largest modulus is 1."""

    def at(speed: float) -> CirculatingSolution:
        solution = _found(case, one, other, speed)
        if solution is None:
            raise _LostBranch
        return solution

    try:
        ends = one.speed, other.speed
        xtol = DIGITS * abs(one.speed)
        speed = float(brentq(lambda s: at(s).largest - 1.0, *ends, xtol=xtol))
        solution = at(speed)
        beside = at(speed * (1.0 - BESIDE)), at(speed * (1.0 + BESIDE))
    except _LostBranch:
        return None
    slope = math.log(beside[1].value / beside[0].value) / (2.0 * BESIDE)
    return CirculationBorder(solution.value, solution.spindle_speed, speed, abs(slope) < FLAT_SLOPE)


class _LostBranch(Exception):
    """Error: no solution was found between two known ones."""

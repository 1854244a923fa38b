"""Taylor's method, which chooses its own steps; the scene's steps are samples within them.

See ``ab_sim.engine.taylor``. Sources: Jorba and Zou (2005), Exp. Math. 14, 99-117, for order and
length of a step from the tolerance; Moore, Interval Analysis (1966), ch. 11, for the recurrences.
"""

import math
from typing import Any, NamedTuple

from ab_sim.engine.integrate.registry import Parameter, Stepper, register_family

PARTS = 1024
"""Maximum number of parts into which a step of the scene is divided."""
LOWEST, HIGHEST = 6, 16
"""Lowest and highest order."""
_MOST_STEPS = 8
"""Maximum number of the scene's steps in one of the method's own, if a number is given."""
_TOLERANCE = Parameter(
    "largest last term of each step's series, for the balls' angles and for the deck's "
    "displacement over the race's radius",
    1e-11,
    1e-16,
    1e-2,
    "rad",
)
ORDER = Parameter(
    "order of the series; 0 chooses it from the tolerance",
    0.0,
    0.0,
    float(HIGHEST),
    values=(0.0, *map(float, range(LOWEST, HIGHEST + 1))),
)


STEPS = Parameter(
    "number of the scene's steps in one step of the method, without a check of the error; 0: "
    "the tolerance decides, and a step of the method may be shorter than one of the scene",
    0.0,
    0.0,
    float(_MOST_STEPS),
    values=tuple(map(float, range(_MOST_STEPS + 1))),
)


class TaylorParameters(NamedTuple):
    """Parameters of Taylor's method."""

    tolerance: float
    """Largest last term of a series [rad]."""
    order: int
    """Order of the series."""
    steps: float
    """Number of the scene's steps in each of the method's own; 0 to choose by the tolerance."""


def order_for(tolerance: float) -> int:
    """Return the order with which a run to a tolerance [rad] is nearly fastest.

    The work of a step grows with the square of its order p, its length with tolerance^(1/p). Work
    per time is then least at p = -log(tolerance) / 2 (Jorba and Zou, 3.1).
    """
    return min(max(round(-0.5 * math.log(tolerance)), LOWEST), HIGHEST)


@register_family("taylor", {"tolerance": _TOLERANCE, "order": ORDER, "steps": STEPS})
def taylor(tolerance: float, order: float, steps: float) -> Stepper:
    """Return the method for a tolerance [rad], an order, and a number of the scene's steps."""
    chosen = int(order) or order_for(tolerance)

    length = steps or 1.0
    """Length of the method's own steps, in steps of the scene or in parts of one."""

    def growth(z: Any) -> Any:
        term = total = 1.0 + 0.0j
        for k in range(1, chosen + 1):
            term *= z * length / k
            total += term
        return total

    return Stepper(
        "taylor",
        chosen,
        "Jorba and Zou (2005), Exp. Math. 14, 99-117",
        TaylorParameters(tolerance, chosen, steps),
        evaluations=chosen,
        growth=growth,
        memory=1,
        parts=1 if steps else PARTS,
        takes_lanes=True,
        locates_events=False,
        keeps_tolerance=True,
    )

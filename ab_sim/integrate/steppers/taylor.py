"""Taylor's method, in steps of its own, the scene's steps being samples in them.

See ``ab_sim.taylor``. Jorba and Zou (2005), Exp. Math. 14, 99-117: order and length of a step from
the tolerance; Moore, Interval Analysis (1966), ch. 11: coefficients by recurrences.
"""

import math
from typing import NamedTuple

from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.stepper import Stepper

PARTS = 1024
"""Into how many parts a step of the scene may be cut."""
LOWEST, HIGHEST = 6, 16
"""Orders."""
TOLERANCE = Parameter(
    "how large the last term of each step's series may be, in balls' angles and in the deck's "
    "displacement over the race's radius",
    1e-11,
    1e-16,
    1e-2,
    "rad",
)
ORDER = Parameter(
    "of the series; 0 for the one that suits the tolerance",
    0.0,
    0.0,
    float(HIGHEST),
    values=(0.0, *map(float, range(LOWEST, HIGHEST + 1))),
)


class TaylorParameters(NamedTuple):
    """What the method is told."""

    tolerance: float
    """rad."""
    order: int


def order_for(tolerance: float) -> int:
    """The order with which a run takes least time, or nearly so: Jorba and Zou, 3.1."""
    wanted = math.ceil(1.0 - 0.5 * math.log(tolerance))
    return min(max(wanted, LOWEST), HIGHEST)


@register_family("taylor", {"tolerance": TOLERANCE, "order": ORDER})
def taylor(tolerance: float, order: float) -> Stepper:
    """The method with a tolerance [rad] and an order."""
    chosen = int(order) or order_for(tolerance)

    def growth(z: complex) -> complex:
        term = total = 1.0 + 0.0j
        for k in range(1, chosen + 1):
            term *= z / PARTS / k
            total += term
        return complex(total**PARTS if abs(total) < 2.0 else math.inf)

    return Stepper(
        "taylor",
        chosen,
        "Jorba and Zou (2005), Exp. Math. 14, 99-117",
        TaylorParameters(tolerance, chosen),
        evaluations=chosen,
        growth=growth,
        memory=1,
        parts=PARTS,
        takes_lanes=True,
        locates_events=False,
        priced=False,
        keeps_tolerance=True,
    )

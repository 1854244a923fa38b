"""Collocation on Gauss nodes, in steps of its own, the scene's steps being samples in them.

See ``ab_sim.collocation`` for the method. Of order 16 at the end of a step where the iterations are
carried far enough: Gauss nodes, Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I,
II.7; Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339: exponential collocation.
"""

import cmath
from typing import NamedTuple

from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.steppers.rk8 import RK8

NODES = 8
"""Gauss nodes of a step."""
SAMPLES = 16
"""Of the scene's steps in one of its own, at most."""
PARTS = 1024
"""Into how many parts a step of the scene may be cut."""


class Collocation(NamedTuple):
    """What the method is told."""

    tolerance: float
    """rad."""
    steps: float
    """Of the scene in each of its own; 0 as many as the tolerance allows."""


TOLERANCE = Parameter(
    "what each of its spans may leave of an error, in balls' angles and in the deck's displacement "
    "over the race's radius [rad]",
    1e-11,
    1e-16,
    1e-2,
)
STEPS = Parameter(
    "how many of the scene's steps each of its spans goes over, rounded down to 1, 2, 3, 4, 6, 8, "
    "12 or 16, whatever error that leaves; 0 for as many as the tolerance allows",
    0.0,
    0.0,
    float(SAMPLES),
)


def growth_of(z: complex) -> complex:
    """What a step makes of what it solves exactly: drag, and the deck's own motion."""
    return cmath.exp(complex(min(z.real, 0.0), z.imag))


@register_family("collocation", {"tolerance": TOLERANCE, "steps": STEPS})
def collocation(tolerance: float, steps: float) -> Stepper:
    """The method with a tolerance [rad], and a number of steps in a span."""
    return Stepper(
        "collocation",
        2 * NODES,
        "Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339, on Gauss nodes",
        Collocation(tolerance, steps),
        evaluations=5 * NODES,
        growth=growth_of,
        spans=True,
        parts=PARTS,
        needs_own_motion=True,
        solves_drag=True,
        over_events=RK8,
        keeps_tolerance=True,
    )

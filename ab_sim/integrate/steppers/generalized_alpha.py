"""Generalized-alpha for first-order equations: implicit, with damping of what is fast by choice.

With am = (3 - rho) / (2 (1 + rho)), af = 1 / (1 + rho), gamma = 1/2 + am - af: of order 2, stable
for any step, and what is infinitely fast is multiplied by -rho in each. See ``stepping.implicit``
for the step.

Jansen, Whiting and Hulbert (2000), Comput. Methods Appl. Mech. Engrg. 190, 305-319; Chung and
Hulbert (1993), J. Appl. Mech. 60, is the second-order form that deck-3d used.
"""

import functools
from typing import NamedTuple

import numpy as np

from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.stepper import Stepper

ROUNDING = 1e-7
"""In the modulus of a root: two that are nearly equal are found to half of the digits."""


class Alpha(NamedTuple):
    """What a step is made with."""

    mass: float
    """am, where between the ends y' is taken."""
    force: float
    """af, where f is."""
    newmark: float
    """gamma."""


def growth_of(weights: Alpha, z: complex) -> complex:
    """What one step makes of y' = lambda y, z = step times lambda: its larger root.

    A step maps (y, h y'); of the two roots one follows y, and one is the method's own.
    """
    am, af, gamma = weights
    a = am - gamma * af * z
    b = 1.0 - 2.0 * am - (gamma * (1.0 - af) + (1.0 - gamma) * af) * z
    c = am - 1.0 - (1.0 - gamma) * (1.0 - af) * z
    largest = complex(max(np.roots([a, b, c]), key=abs))
    # With rho = 1 the method's own root is -1 for any z.
    return largest / abs(largest) if 1.0 < abs(largest) < 1.0 + ROUNDING else largest


RADIUS = Parameter(
    "share that a step leaves of what is infinitely fast: 0 takes it away at once, 1 keeps it",
    default=0.8,
    lowest=0.0,
    highest=1.0,
)


@register_family("generalized-alpha", {"rho_inf": RADIUS})
def generalized_alpha(rho_inf: float) -> Stepper:
    """The method that leaves ``rho_inf`` of what is infinitely fast in each step."""
    am, af = (3.0 - rho_inf) / (2.0 * (1.0 + rho_inf)), 1.0 / (1.0 + rho_inf)
    weights = Alpha(am, af, 0.5 + am - af)
    return Stepper(
        "generalized-alpha",
        2,
        "Jansen, Whiting and Hulbert (2000), Comput. Methods Appl. Mech. Engrg. 190, 305-319",
        weights,
        evaluations=4,
        growth=functools.partial(growth_of, weights),
        memory=1,
        locates_events=False,
        priced=False,
    )

"""Generalized-alpha for first-order equations: implicit, with selectable damping of fast motions.

With am = (3 - rho) / (2 (1 + rho)), af = 1 / (1 + rho), gamma = 1/2 + am - af, the method has order
2 and is stable for any step. In each step it multiplies infinitely fast motions by -rho. See
``stepping.implicit`` for the step.

Source: Jansen, Whiting and Hulbert (2000), Comput. Methods Appl. Mech. Engrg. 190, 305-319. Chung
and Hulbert (1993), J. Appl. Mech. 60, is the form for second-order equations, which deck-3d used.
"""

import functools
from typing import Any, NamedTuple

import numpy as np

from ab_sim.engine.integrate.registry import Parameter, Stepper, register_family

ROUNDING = 1e-7
"""Bound of the rounding error of a root's modulus: nearly equal roots have half as many correct
digits."""


class Alpha(NamedTuple):
    """Parameters of the generalized-alpha method."""

    mass: float
    """Weight am: position between a step's ends at which y' is taken."""
    force: float
    """Weight af: position between a step's ends at which f is taken."""
    newmark: float
    """Newmark's gamma: weight of y' at the step's end in the increment of y."""


def _growth_of(weights: Alpha, z: Any) -> Any:
    """Return the growth per step for y' = lambda y, z = step times lambda: the larger root.

    A step maps (y, h y') linearly. Of the two eigenvalues of this map, one approximates the
    solution, and the other one is parasitic.
    """
    am, af, gamma = weights
    a = am - gamma * af * z
    b = 1.0 - 2.0 * am - (gamma * (1.0 - af) + (1.0 - gamma) * af) * z
    c = am - 1.0 - (1.0 - gamma) * (1.0 - af) * z
    half = np.sqrt(b * b - 4.0 * a * c + 0j)
    roots = (-b - half) / (2.0 * a), (-b + half) / (2.0 * a)
    largest = np.where(abs(roots[0]) > abs(roots[1]), *roots)
    # With rho = 1, the parasitic root is -1 for any z; rounding must not make it unstable.
    rounded = (1.0 < abs(largest)) & (abs(largest) < 1.0 + ROUNDING)
    return np.where(rounded, largest / abs(largest), largest)


RADIUS = Parameter(
    "factor by which a step multiplies infinitely fast motions: 0 damps them at once, 1 keeps them",
    default=0.8,
    lowest=0.0,
    highest=1.0,
)


@register_family("generalized-alpha", {"rho_inf": RADIUS})
def generalized_alpha(rho_inf: float) -> Stepper:
    """Return the method that multiplies infinitely fast motions by ``-rho_inf`` in each step."""
    am, af = (3.0 - rho_inf) / (2.0 * (1.0 + rho_inf)), 1.0 / (1.0 + rho_inf)
    weights = Alpha(am, af, 0.5 + am - af)
    return Stepper(
        "generalized-alpha",
        2,
        "Jansen, Whiting and Hulbert (2000), Comput. Methods Appl. Mech. Engrg. 190, 305-319",
        weights,
        evaluations=4,
        growth=functools.partial(_growth_of, weights),
        memory=1,
        locates_events=False,
        priced=False,
    )

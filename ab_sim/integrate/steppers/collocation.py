"""Collocation on Gauss nodes, in steps of its own, the scene's steps being samples in them.

See ``ab_sim.collocation`` for the method. Of order 16 at the end of a step where the iterations are
carried far enough: Gauss nodes, Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I,
II.7; Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339: exponential collocation.
"""

import cmath
from typing import NamedTuple

from ab_sim.errors import SceneError
from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.steppers.rk8 import RK8

FEW, MANY = 8, 16
"""Nodes of a step."""
FINE = 1e-11
"""Tolerance [rad] below which ``MANY`` nodes take less time, but for scenes with many events."""
SAMPLES = {FEW: (1, 2, 3, 4, 6, 8, 12, 16), MANY: (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)}
"""How many of the scene's steps one of its own may go over, by its nodes."""
POWERS = {FEW: 8, MANY: 10}
"""How many of Legendre's polynomials are carried on into the next step: more than these grow more
than they say."""
PARTS = 1024
"""Into how many parts a step of the scene may be cut."""


class Collocation(NamedTuple):
    """What the method is told."""

    nodes: int
    """N of a step."""
    samples: tuple[int, ...]
    """How many of the scene's steps one of its own may go over."""
    powers: int
    """How many polynomials are carried on into the next step."""
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
    "12 or 16, with 16 nodes 24 or 32, whatever error that leaves; 0 for as many as the tolerance "
    "allows",
    0.0,
    0.0,
    float(SAMPLES[MANY][-1]),
)
NODES = Parameter(
    f"how many nodes each of its steps has: {FEW} or {MANY}; 0 for {MANY} where the tolerance is "
    f"below {FINE:g} rad, else {FEW}",
    0.0,
    0.0,
    float(MANY),
)


def growth_of(z: complex) -> complex:
    """What a step makes of what it solves exactly: drag, and the deck's own motion."""
    return cmath.exp(complex(min(z.real, 0.0), z.imag))


@register_family("collocation", {"tolerance": TOLERANCE, "steps": STEPS, "nodes": NODES})
def collocation(tolerance: float, steps: float, nodes: float) -> Stepper:
    """The method with a tolerance [rad], a number of the scene's steps in its own, and nodes.

    Raises:
        SceneError: there is no such number of nodes.
    """
    count = int(nodes) or (MANY if tolerance < FINE else FEW)
    if count not in SAMPLES or (nodes and count != nodes):
        raise SceneError(
            f"solver.parameters.nodes = {nodes:g}: must be 0, {FEW} or {MANY}; {NODES.meaning}"
        )
    own = Collocation(count, SAMPLES[count], POWERS[count], tolerance, steps)
    return Stepper(
        "collocation",
        2 * count,
        "Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339, on Gauss nodes",
        own,
        evaluations=5 * count,
        growth=growth_of,
        spans=True,
        parts=PARTS,
        needs_own_motion=True,
        solves_drag=True,
        over_events=RK8,
        keeps_tolerance=True,
    )

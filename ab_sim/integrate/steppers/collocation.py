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

FINE = 1e-11
"""Tolerance [rad] below which sixteen nodes take less time, where nothing cuts the steps."""
PARTS = 1024
"""Into how many parts a step of the scene may be cut."""


class Setting(NamedTuple):
    """A number of nodes, and what goes with it."""

    nodes: int
    """N, a power of two."""
    samples: tuple[int, ...]
    """How many of the scene's steps one of its own may go over, rising."""
    powers: int
    """How many of Legendre's polynomials are carried on into the next step: more than these grow
    more than they say."""


EIGHT = Setting(8, (1, 2, 3, 4, 6, 8, 12, 16), 8)
SIXTEEN = Setting(16, (*EIGHT.samples, 24, 32), 10)
SETTINGS = {setting.nodes: setting for setting in (EIGHT, SIXTEEN)}


class CollocationParameters(NamedTuple):
    """What the method is told."""

    setting: Setting | None
    """None: as the scene calls for, see ``setting_for``."""
    tolerance: float
    """rad."""
    steps: float
    """Of the scene in each of its own; 0 as many as the tolerance allows."""


TOLERANCE = Parameter(
    "truncation error of each collocation step, in balls' angles and in the deck's displacement "
    "over the race's radius",
    1e-11,
    1e-16,
    1e-2,
    "rad",
)
STEPS = Parameter(
    "how many of the scene's steps a collocation step goes over, rounded down to 1, 2, 3, 4, 6, 8, "
    "12 or 16, with 16 nodes 24 or 32, whatever error that leaves; 0 for as many as the tolerance "
    "allows",
    0.0,
    0.0,
    float(SIXTEEN.samples[-1]),
)
NODES = Parameter(
    f"how many nodes each of its steps has: 8 or 16; 0 for 16 where the tolerance is below "
    f"{FINE:g} rad, and the deck moves in the plane without friction, contact or a motor, else 8",
    0.0,
    0.0,
    float(SIXTEEN.nodes),
    values=(0.0, *map(float, SETTINGS)),
)


def growth_of(z: complex) -> complex:
    """What a step makes of what it solves exactly: drag, and the deck's own motion."""
    return cmath.exp(complex(min(z.real, 0.0), z.imag))


@register_family("collocation", {"tolerance": TOLERANCE, "steps": STEPS, "nodes": NODES})
def collocation(tolerance: float, steps: float, nodes: float) -> Stepper:
    """The method with a tolerance [rad], a number of the scene's steps in its own, and nodes."""
    setting = SETTINGS[int(nodes)] if nodes else None
    count = int(nodes) or EIGHT.nodes  # at least
    return Stepper(
        "collocation",
        2 * count,
        "Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339, on Gauss nodes",
        CollocationParameters(setting, tolerance, steps),
        evaluations=5 * count,
        growth=growth_of,
        collocation_steps=True,
        parts=PARTS,
        needs_own_motion=True,
        solves_drag=True,
        over_events=RK8,
        keeps_tolerance=True,
    )


def setting_for(own: CollocationParameters, is_smooth: bool) -> Setting:
    """The setting that makes runs of a scene fastest, if none is named.

    Long steps are worth little where events cut them; in space they take many iterations.

    Args:
        own: what the method is told.
        is_smooth: whether the deck moves in the plane, and no law takes another branch.
    """
    return own.setting or (SIXTEEN if is_smooth and own.tolerance < FINE else EIGHT)

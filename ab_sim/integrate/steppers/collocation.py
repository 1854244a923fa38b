"""Collocation on Gauss nodes, in the method's own steps, in which the scene's steps are samples.

See ``ab_sim.collocation`` for the method. With converged iterations, the order at a step's end is
twice the number of nodes. Gauss nodes: Hairer, Norsett, Wanner, Solving Ordinary Differential
Equations I, II.7; exponential collocation: Hochbruck and Ostermann (2005), Appl. Numer. Math. 53,
323-339.
"""

import cmath
from typing import NamedTuple

from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.steppers.rk8 import RK8

FINE = 1e-11
"""Tolerance [rad] below which sixteen nodes are faster, if no events cut the steps."""
PARTS = 1024
"""Maximum number of parts into which a step of the scene is divided."""


class Setting(NamedTuple):
    """Number of nodes, and the settings that depend on it."""

    nodes: int
    """Number of nodes N, a power of two."""
    samples: tuple[int, ...]
    """Numbers of the scene's steps in one of the method's own, in ascending order."""
    powers: int
    """Number of Legendre polynomials that are extrapolated into the next step. Higher ones grow
    too much outside their interval to improve the prediction."""


EIGHT = Setting(8, (1, 2, 3, 4, 6, 8, 12, 16), 8)
SIXTEEN = Setting(16, (*EIGHT.samples, 24, 32), 10)
SETTINGS = {setting.nodes: setting for setting in (EIGHT, SIXTEEN)}


class CollocationParameters(NamedTuple):
    """Parameters of the method."""

    setting: Setting | None
    """Setting; None for a choice by the scene, see ``setting_for``."""
    tolerance: float
    """Tolerance [rad]."""
    steps: float
    """Number of the scene's steps in each of the method's own; 0 for the tolerance's choice."""


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
    """Return the growth per step of motions that are solved exactly: drag, deck's own motion."""
    return cmath.exp(complex(min(z.real, 0.0), z.imag))


@register_family("collocation", {"tolerance": TOLERANCE, "steps": STEPS, "nodes": NODES})
def collocation(tolerance: float, steps: float, nodes: float) -> Stepper:
    """Return the method for a tolerance [rad], a number of the scene's steps, and of nodes."""
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
    """Return the setting with which a scene runs fastest, unless one is given.

    Long steps gain little if events cut them. With a deck in space they take many iterations.

    Args:
        own: parameters of the method.
        is_smooth: True if the deck moves in the plane and there are no events.
    """
    return own.setting or (SIXTEEN if is_smooth and own.tolerance < FINE else EIGHT)

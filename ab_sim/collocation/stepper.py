"""The method by name, with its parameters."""

import cmath
from typing import NamedTuple

from ab_sim.collocation.assemble import COORDINATES, Setting, method_of
from ab_sim.collocation.lengths import PARTS
from ab_sim.collocation.run import Method
from ab_sim.integrate.registry import Parameter
from ab_sim.kernels.model import Model

NAME = "collocation"
SOURCE = "Hochbruck and Ostermann (2005), Appl. Numer. Math. 53, 323-339, on Gauss nodes"
FEW, MANY = 8, 16
"""Nodes of a step."""
FINE = 3e-10
"""Tolerance [rad] below which ``MANY`` nodes take less time, as far as they ever do."""
SAMPLES = {FEW: (1, 2, 3, 4, 6, 8, 12, 16), MANY: (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)}
"""How many samples a step may have, by its nodes."""
POWERS = {FEW: 8, MANY: 10}
"""How many of Legendre's polynomials are carried on into the next step: more than these grow more
than they say."""
PARAMETERS = {
    "tolerance": Parameter(
        "what each of its steps may leave of an error, in balls' angles and in the deck's "
        "displacement over the race's radius [rad]",
        1e-11,
        1e-16,
        1e-2,
    ),
    "steps": Parameter(
        "how many of the scene's steps each of its own goes over, rounded down to 1, 2, 3, 4, 6, "
        "8, 12 or 16, whatever error that leaves; 0 for as many as the tolerance allows",
        0.0,
        0.0,
        float(SAMPLES[FEW][-1]),
    ),
    "nodes": Parameter(
        f"how many nodes each of its steps has: {FEW} or {MANY}; 0 for {MANY} in the plane and "
        f"without friction and contact, if the tolerance is below {FINE:g} rad, else {FEW}",
        0.0,
        0.0,
        float(MANY),
    ),
}


class CollocationStepper(NamedTuple):
    """The method with its parameters: what runs of any scene share."""

    nodes: int
    order: int
    """Of the error at the end of a step."""
    method: Method
    parts: int = PARTS
    """The finest parts of a step of the scene."""


def nodes_for(tolerance: float, model: Model) -> int:
    """How many nodes make the run of a scene fastest.

    Long steps are worth little where events cut them; in space, they take many iterations.

    Args:
        tolerance: of a step [rad].
        model: the scene's equations.
    """
    in_space = COORDINATES[type(model.deck).__name__].has_modes
    smooth = not (in_space or model.has_friction or model.has_contact)
    return MANY if smooth and tolerance < FINE else FEW


def collocation(tolerance: float, steps: float, nodes: float, model: Model) -> CollocationStepper:
    """The method.

    Args:
        tolerance, steps, nodes: see ``PARAMETERS``.
        model: the scene's equations, which say how many nodes there are, if nobody does.
    """
    count = int(nodes) or nodes_for(tolerance, model)
    setting = Setting(count, SAMPLES[count], POWERS[count])
    return CollocationStepper(count, 2 * count, method_of(setting, tolerance, steps))


def growth_of(z: complex) -> complex:
    """What a step makes of what it solves exactly: drag, and the deck's own motion."""
    return cmath.exp(complex(min(z.real, 0.0), z.imag))

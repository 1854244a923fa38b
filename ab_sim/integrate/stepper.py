"""What a stepper is, and what may be asked of one.

Who chooses, prices or runs steppers asks for an ability by its name, never for a class. A stepper
is one file in ``steppers/``: it makes a ``Stepper`` and registers what makes it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class Stepper:
    """A named method for steps of a fixed length, with the order that it is declared to have."""

    name: str
    order: int
    source: str
    weights: Any
    """A NamedTuple of numbers that say how steps are taken: a ``Tableau``, of which a step is
    emitted for each scene; or what the method's own code in the subset of ``ab_sim.compiling``
    takes."""
    evaluations: int
    """Of the right-hand side per step."""
    growth: Callable[[complex], complex]
    """What one step makes of y' = lambda y, from z = step times lambda. With an ability that makes
    some part of the equations harmless: with the amount of it that is worst."""
    memory: int = 0
    """Rows of numbers that it carries from one step to the next; they belong to the state. It
    starts anew where they are zero, and they are made so where the motion has a kink."""
    collocation_steps: bool = False
    """Its own steps are collocation steps of several of the scene's, and belong to the state:
    memory has a line for each state's motion in it, one for the state at its beginning, and two
    more. It starts anew where they are zero."""
    parts: int = 1
    """Into how many it divides a step of the scene, where the motion asks for that."""
    needs_own_motion: bool = False
    """It needs to know what of the deck's motion is linear: see ``dynamics.own_motion``."""
    solves_drag: bool = False
    """Any amount of the race's drag leaves it stable."""
    takes_lanes: bool = False
    """Runs side by side can take its steps."""
    locates_events: bool = True
    """Its steps may be cut at events, or handed over to another stepper."""
    over_events: "Stepper | None" = None
    """The other stepper, to which those steps are handed over."""
    priced: bool = True
    """It is tried where a scene asks for an accuracy."""
    keeps_tolerance: bool = False
    """Its error follows from its parameter ``tolerance``, and not from the step."""

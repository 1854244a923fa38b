"""What a stepper is, and what may be asked of one.

Who chooses, prices or runs steppers asks for an ability by its name, never for a class. A stepper
is one file in ``steppers/``: it makes a ``Stepper`` and registers what makes it.
"""

import dataclasses
import functools
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
    """What one step, or part of one, makes of y' = lambda y, from z = its length times lambda."""
    memory: int = 0
    """Rows of numbers that it carries from one step to the next; they belong to the state. It
    starts anew where they are zero, and they are made so where the motion has a kink."""
    parts: int = 1
    """Into how many it divides a step of the scene, where the motion asks for that."""
    solves_drag: bool = False
    """Any amount of the race's drag leaves it stable."""
    takes_lanes: bool = False
    """Runs side by side can take its steps."""
    locates_events: bool = True
    """Its steps may be cut at events."""
    priced: bool = True
    """It is tried where a scene asks for an accuracy."""
    keeps_tolerance: bool = False
    """Its error follows from its parameter ``tolerance``, and not from the step."""

    def in_parts(self, parts: int) -> "Stepper":
        """The same method, which divides each step of the scene into equal parts."""
        return self if parts == 1 else _divided(self, parts)


@functools.cache
def _divided(stepper: Stepper, parts: int) -> Stepper:
    return dataclasses.replace(stepper, parts=parts)

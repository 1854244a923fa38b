"""Description of a stepper and its abilities.

Code that chooses, prices or runs steppers queries abilities by name, never a class. A stepper is
one file in ``steppers/``, which registers a ``Stepper`` or a function that creates one.
"""

import dataclasses
import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class Stepper:
    """Named method for steps of a fixed length, with its declared order and abilities."""

    name: str
    order: int
    source: str
    weights: Any
    """NamedTuple of the method's numbers: a ``Tableau``, from which a step is emitted for each
    scene, or the input of the method's own code in the subset of ``ab_sim.engine.compiling``."""
    evaluations: int
    """Evaluations of the right-hand side per step."""
    growth: Callable[[complex], complex]
    """Stability function: factor by which one step, or one part of it, multiplies y for
    y' = lambda y, as a function of z = its length times lambda. With ``solves_drag``, lambda is the
    rate of any motion except drag."""
    memory: int = 0
    """Rows of numbers carried from one step to the next, which belong to the state. Zeros restart
    the method; they are set to zero where the motion has a kink."""
    parts: int = 1
    """Number of parts into which the method divides a step of the scene; for ``taylor`` the
    maximum."""
    solves_drag: bool = False
    """True if the method is stable for any amount of the race's drag."""
    takes_lanes: bool = False
    """True if several runs can take its steps together, in lanes."""
    locates_events: bool = True
    """True if its steps can be cut at events."""
    priced: bool = True
    """True if the method is tried when a scene requests an accuracy."""
    keeps_tolerance: bool = False
    """True if the error depends on the parameter ``tolerance`` and not on the step."""

    def in_parts(self, parts: int) -> "Stepper":
        """Return this method with each step of the scene divided into equal parts."""
        return self if parts == 1 else _divided(self, parts)


@functools.cache
def _divided(stepper: Stepper, parts: int) -> Stepper:
    return dataclasses.replace(stepper, parts=parts)

"""Description of a stepper and its abilities.

Code that chooses, prices or runs steppers queries abilities by name, never a class. A stepper is
one file in ``steppers/``, which registers a ``Stepper`` or a function that creates one.
"""

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
    scene, or the input of the method's own code in the subset of ``ab_sim.compiling``."""
    evaluations: int
    """Evaluations of the right-hand side per step."""
    growth: Callable[[complex], complex]
    """Stability function: factor by which one step multiplies y for y' = lambda y, as a function
    of z = step times lambda. For a method that solves part of the equations exactly, the factor
    for the worst size of that part."""
    memory: int = 0
    """Rows of numbers carried from one step to the next, which belong to the state. Zeros restart
    the method; they are set to zero where the motion has a kink."""
    collocation_steps: bool = False
    """True if the method's own steps are collocation steps over several of the scene's, and belong
    to the state. Memory then has a line for each state's motion in the step, one for the state at
    its beginning, and two more. Zeros restart the method."""
    parts: int = 1
    """Maximum number of parts into which the method divides a step of the scene."""
    needs_own_motion: bool = False
    """True if the method needs the linear part of the deck's motion, ``dynamics.own_motion``."""
    solves_drag: bool = False
    """True if the method is stable for any amount of the race's drag."""
    takes_lanes: bool = False
    """True if several runs can take its steps together, in lanes."""
    locates_events: bool = True
    """True if its steps can be cut at events, or handed over to another stepper."""
    over_events: "Stepper | None" = None
    """Stepper to which steps with events are handed over."""
    priced: bool = True
    """True if the method is tried when a scene requests an accuracy."""
    keeps_tolerance: bool = False
    """True if the error depends on the parameter ``tolerance`` and not on the step."""

"""What a stepper is, and what may be asked of one.

Who chooses, prices or runs steppers asks for an ability by its name, never for a class. A stepper
is one file in ``steppers/``: it makes a ``Stepper`` and registers what makes it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ab_sim.dynamics.dispatch import forward


@dataclass(frozen=True, eq=False)
class Stepper:
    """A named method for steps of a fixed length, with the order that it is declared to have."""

    name: str
    order: int
    source: str
    weights: Any
    """A NamedTuple of what the compiled step needs, with the method

        step(self, plant, begin, length, state, work)
            from ``begin``, local time [s], over ``length`` [s]; ``work.slopes[0]`` holds the slope
            at the start; the result goes into ``work.trial``, and the state stays as it is

    or, of one that takes spans, with the static method

        march(run, stretch, rows, steps)
            in place of ``fixed_step.step_by_step``
    """
    evaluations: int
    """Of the right-hand side per step."""
    growth: Callable[[complex], complex]
    """What one step makes of y' = lambda y, from z = step times lambda. With an ability that makes
    some part of the equations harmless: with the amount of it that is worst."""
    slopes: int
    """Slopes that a step keeps: rows of the workspace."""
    memory: int = 0
    """Rows of numbers that it carries from one step to the next; they belong to the state. It
    starts anew where they are zero, and they are made so where the motion has a kink."""
    spans: bool = False
    """Its own steps are spans of several of the scene's, and belong to the state: memory has a line
    of eight numbers for each state's motion in it, one for the state at its beginning, and two
    more. It starts anew where they are zero."""
    parts: int = 1
    """Into how many it divides a step of the scene, where the motion asks for that."""
    tables: int = 0
    """Lines of eight numbers that it keeps for each equation of second order and for one thing
    more, as long as they serve; they follow from the scene and the step's length, and are no part
    of the state."""
    own_motion_at: int | None = None
    """From which of these lines on it finds what of the motion of what carries the balls is linear:
    it needs to know that; see ``carriers.own_motion``."""
    solves_drag: bool = False
    """Any amount of the race's drag leaves it stable."""
    takes_lanes: bool = False
    """Runs side by side can take its steps: ``numbers.lanes``."""
    locates_events: bool = True
    """Its steps may be cut at events, or handed over to another stepper."""
    over_events: "Stepper | None" = None
    """The other stepper, to which those steps are handed over."""
    priced: bool = True
    """It is tried where a scene asks for an accuracy."""
    keeps_tolerance: bool = False
    """Its error follows from its parameter ``tolerance``, and not from the step."""


step = forward("step")
"""``step(weights, plant, begin, length, state, work)``, see ``Stepper.weights``."""

"""What a stretch of time makes of a state, and of all states near it.

Duals are stepped by the same steppers as floats: the values are those of a run, and the partial
derivatives those of the steps that were taken, to rounding, not of the motion that they
approximate (Griewank and Walther, Evaluating Derivatives (2008), ch. 3).
"""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.dynamics.assemble import place_on
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.numbers.duals import PARTIALS, dual, partial_of, value_of
from ab_sim.dynamics.slope import evaluate
from ab_sim.dynamics.system import Plant, System, ball_count, has_events
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.on_stack import own_array, own_room
from ab_sim.integrate.stepper import Stepper, step
from ab_sim.spindle import Piece


class Flown(NamedTuple):
    """Where steps of one length have led."""

    states: np.ndarray
    """The state at the start and after each step, shape (steps + 1, states); angles as they grow,
    whole turns not taken out."""
    matrix: np.ndarray
    """d end_i / d start_j, shape (states, columns)."""


class Flow:
    """The flow of a scene's equations, in steps of a fixed length, and its exact derivative.

    Args:
        system: what moves; it has no events.
        piece: of the speed profile, taken to go on for ever.
        modes: as of a ``Plant``.
        stepper: one of those that take lanes: what can be stepped with other numbers than floats.

    Raises:
        ValueError: the system has events, at which the flow has kinks and jumps that its steps
            would have to be cut at; or the stepper takes floats only.
    """

    def __init__(self, system: System, piece: Piece, modes: np.ndarray, stepper: Stepper) -> None:
        if has_events(system.effects):
            raise ValueError("the system has events, and its flow no derivative without them")
        if not stepper.takes_lanes:
            raise ValueError(f"{stepper.name}: takes steps with floats only")
        self.layout, self.stepper = layout_of(system), stepper
        # One kernel for any number of balls: no digit is gained by knowing it, and many are tried.
        self._system = system._replace(each=ball_count(system))
        self._place, self._modes = place_on(piece), modes

    def over(
        self, start: np.ndarray, duration: float, steps: int, columns: int | None = None
    ) -> Flown:
        """From the start of the piece on.

        Args:
            start: the state, shape (states,).
            duration: s.
            steps: how many it is cut into.
            columns: by how many of the start's entries, the first ones, there are to be
                derivatives; default all.
        """
        size = self.layout.size
        count = size if columns is None else columns
        found = Flown(np.empty((steps + 1, size)), np.empty((size, count)))
        found.states[0] = start
        length = duration / steps
        passes = self._system, self._place, self.stepper.weights, self.stepper.slopes, self._modes
        flow(*passes, length, found.states, found.matrix)
        return found


class DualArrays(NamedTuple):
    """What one step writes to, as duals; the same names as of a Workspace."""

    slopes: Any
    trial: Any
    ahead: Any
    room: Any


@compiled
def flow(system, place, weights, rows, modes, length, states, matrix):  # type: ignore[no-untyped-def]
    """Take steps from the first line of ``states`` on, with seven partial derivatives at a time.

    Args:
        system, place, modes: as of a Plant; the number of balls is not compiled in.
        weights: those of a stepper that takes lanes.
        rows: slopes that it keeps.
        length: of a step [s].
        states: shape (steps + 1, states); the first line is given.
        matrix: where derivatives go, shape (states, columns).
    """
    number, size, columns = dual(0.0, 0), states.shape[1], matrix.shape[1]
    state, shape = own_array(number, (size,)), (size,)
    work = DualArrays(
        own_array(number, (rows, size)),
        own_array(number, shape),
        own_array(number, shape),
        own_room(system, ball_count(system), number),
    )
    plant = Plant(system, place, modes, work.room)
    for first in range(0, max(columns, 1), PARTIALS):
        count = min(PARTIALS, columns - first)
        for j in range(size):
            state[j] = states[0, j]
        for k in range(count):
            state[first + k] = dual(states[0, first + k], k)
        for s in range(states.shape[0] - 1):
            evaluate(plant, s * length, state, work.slopes[0])
            step(weights, plant, s * length, length, state, work)
            for j in range(size):
                state[j] = work.trial[j]
                states[s + 1, j] = value_of(state[j])
        for j in range(size):
            for k in range(count):
                matrix[j, first + k] = partial_of(state[j], k)

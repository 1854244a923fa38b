"""What a stretch of time makes of a state, and of all states near it.

Values are those of a run, and the partial derivatives those of the steps that were taken, to
rounding, not of the motion that they approximate (Griewank and Walther, Evaluating Derivatives
(2008), ch. 3): tangents are stepped along with the state, by the same method.
"""

from typing import NamedTuple

import numpy as np

from ab_sim.compiling import compiled
from ab_sim.compiling.kinds import Floats, Table, call, fma
from ab_sim.dynamics.system import System, has_events
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.vector_field import Field, VectorField
from ab_sim.kernels.runge_kutta import Tableau
from ab_sim.spindle import ScheduledSegment


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
        scheduled: of the speed profile, taken to go on for ever.
        discrete_state: branches of set-valued laws, shape (n + 1, MODES).
        stepper: an explicit Runge-Kutta method.

    Raises:
        ValueError: the system has events, at which the flow has kinks and jumps that its steps
            would have to be cut at; or the stepper is of another kind.
    """

    def __init__(
        self,
        system: System,
        scheduled: ScheduledSegment,
        discrete_state: np.ndarray,
        stepper: Stepper,
    ) -> None:
        if has_events(system.effects):
            raise ValueError("the system has events, and its flow no derivative without them")
        if not isinstance(stepper.weights, Tableau):
            raise ValueError(f"{stepper.name}: is no explicit Runge-Kutta method")
        field = VectorField(system, scheduled, discrete_state)
        self.layout, self.stepper = field.layout, stepper
        self._steps = _Steps(field.emitted, *stepper.weights)

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
        found = Flown(np.empty((steps + 1, size)), np.zeros((size, count)))
        found.states[0] = start
        lanes, stages = self._steps.field.lanes, len(self._steps.b)
        blocks = -(-count // lanes)
        room = _Room(
            np.empty((stages, size)),
            np.empty((stages, size)),
            np.zeros((max(blocks, 1) * size, lanes)),
            np.zeros((size + 1, lanes)),
            np.empty((stages * size, lanes)),
        )
        compiled(fly)(self._steps, room, duration / steps, count, found.states, found.matrix)
        return found


class _Steps(NamedTuple):
    field: Field
    a: Table
    b: Floats
    c: Floats


class _Room(NamedTuple):
    at: Table
    """States of the stages, shape (stages, states)."""
    slopes: Table
    """The slopes there."""
    tangents: Table
    """Of each group of lanes, one below the other, shape (groups * states, lanes)."""
    along: Table
    """Of a stage, and the change of time; shape (states + 1, lanes)."""
    rates: Table
    """Of each stage, one below the other, shape (stages * states, lanes)."""


def fly(
    steps: _Steps, room: _Room, length: float, columns: int, states: Table, matrix: Table
) -> None:
    """Take steps from the first line of ``states`` on, and tangents with it.

    Args:
        steps: the equations and the method.
        room: to work in.
        length: of a step [s].
        columns: how many derivatives.
        states: shape (steps + 1, states); the first line is given.
        matrix: where derivatives go, shape (states, columns).
    """
    field, size, lanes = steps.field, states.shape[1], steps.field.lanes
    stages, blocks = steps.b.size, (columns + lanes - 1) // lanes
    tangents, along = room.tangents, room.along
    for k in range(columns):
        tangents[(k // lanes) * size + k, k % lanes] = 1.0
    for s in range(states.shape[0] - 1):
        begin = s * length
        for i in range(stages):
            for j in range(size):
                change = 0.0
                for q in range(i):
                    change = fma(steps.a[i, q], room.slopes[q, j], change)
                room.at[i, j] = fma(length, change, states[s, j])
            field.time[0] = fma(steps.c[i], length, begin)
            call(field.slope, field.c, field.b, room.at[i], room.slopes[i], field.time[0])
        for j in range(size):
            change = 0.0
            for q in range(stages):
                change = fma(steps.b[q], room.slopes[q, j], change)
            states[s + 1, j] = fma(length, change, states[s, j])
        for block in range(blocks):
            own = tangents[block * size : (block + 1) * size]
            for i in range(stages):
                for j in range(size):
                    for lane in range(lanes):
                        change = 0.0
                        for q in range(i):
                            change = fma(steps.a[i, q], room.rates[q * size + j, lane], change)
                        along[j, lane] = fma(length, change, own[j, lane])
                field.time[0] = fma(steps.c[i], length, begin)
                rates = room.rates[i * size : (i + 1) * size]
                call(field.tangent, field.c, field.b, field.time, room.at[i], along, rates)
            for j in range(size):
                for lane in range(lanes):
                    change = 0.0
                    for q in range(stages):
                        change = fma(steps.b[q], room.rates[q * size + j, lane], change)
                    own[j, lane] = fma(length, change, own[j, lane])
    for k in range(columns):
        for j in range(size):
            matrix[j, k] = tangents[(k // lanes) * size + j, k % lanes]

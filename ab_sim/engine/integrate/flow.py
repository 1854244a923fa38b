"""Flow of the equations over a time, and its derivative with respect to the initial state.

The states are those of a run. The derivatives are, up to rounding, exact for the discrete steps
that were taken, not for the continuous motion (Griewank and Walther, Evaluating Derivatives (2008),
ch. 3): tangents are stepped along with the state by the same method.
"""

from typing import NamedTuple

import numpy as np

from ab_sim.engine.compiling import compiled
from ab_sim.engine.compiling.kinds import Floats, Table, call, fma
from ab_sim.engine.integrate.stepper import Stepper
from ab_sim.engine.integrate.vector_field import Field, VectorField
from ab_sim.engine.kernels.runge_kutta import Tableau
from ab_sim.model.dynamics.system import System, has_events
from ab_sim.model.spindle import ScheduledSegment


class Flown(NamedTuple):
    """Result of steps of a fixed length."""

    states: np.ndarray
    """State at the start and after each step, shape (steps + 1, states); angles include whole
    turns."""
    matrix: np.ndarray
    """Derivatives d end_i / d start_j, shape (states, columns)."""


class Flow:
    """Flow of a scene's equations in steps of a fixed length, and its exact derivative.

    Args:
        system: system without events.
        scheduled: segment of the speed profile, continued without end.
        discrete_state: branches of set-valued laws, shape (n + 1, DISCRETE_COLUMNS).
        stepper: explicit Runge-Kutta method.

    Raises:
        ValueError: the system has events, at which the flow has kinks and jumps where steps would
            have to be cut; or the stepper is not an explicit Runge-Kutta method.
    """

    def __init__(
        self,
        system: System,
        scheduled: ScheduledSegment,
        discrete_state: np.ndarray,
        stepper: Stepper,
    ) -> None:
        if has_events(system.effects):
            raise ValueError("the system has events, so its flow has no smooth derivative")
        if not isinstance(stepper.weights, Tableau):
            raise ValueError(f"{stepper.name}: is not an explicit Runge-Kutta method")
        field = VectorField(system, scheduled, discrete_state)
        self.layout, self.stepper = field.layout, stepper
        self._steps = _Steps(field.emitted, *stepper.weights)

    def over(
        self, start: np.ndarray, duration: float, steps: int, columns: int | None = None
    ) -> Flown:
        """Simulate from the start of the segment on.

        Args:
            start: initial state, shape (states,).
            duration: duration [s].
            steps: number of steps.
            columns: number of entries of the initial state, from the first on, with respect to
                which derivatives are computed; default: all.
        """
        size = self.layout.size
        count = size if columns is None else columns
        flown = Flown(np.empty((steps + 1, size)), np.zeros((size, count)))
        flown.states[0] = start
        lanes, stages = self._steps.field.lanes, len(self._steps.b)
        blocks = -(-count // lanes)
        room = _Room(
            np.empty((stages, size)),
            np.empty((stages, size)),
            np.zeros((max(blocks, 1) * size, lanes)),
            np.zeros((size + 1, lanes)),
            np.empty((stages * size, lanes)),
        )
        compiled(take_steps)(self._steps, room, duration / steps, count, flown.states, flown.matrix)
        return flown


class _Steps(NamedTuple):
    field: Field
    a: Table
    b: Floats
    c: Floats


class _Room(NamedTuple):
    at: Table
    """States of the stages, shape (stages, states)."""
    slopes: Table
    """Slopes of the stages, shape (stages, states)."""
    tangents: Table
    """Tangents, the groups of lanes below each other, shape (groups * states, lanes)."""
    along: Table
    """Tangents of a stage, and the change of time; shape (states + 1, lanes)."""
    rates: Table
    """Rates of the tangents, the stages below each other, shape (stages * states, lanes)."""


def take_steps(
    steps: _Steps, room: _Room, length: float, columns: int, states: Table, matrix: Table
) -> None:
    """Take steps from the first line of ``states`` on, together with tangents.

    Args:
        steps: equations and method.
        room: work arrays.
        length: length of a step [s].
        columns: number of derivatives.
        states: input and output, shape (steps + 1, states); the first line is the initial state.
        matrix: output, derivatives, shape (states, columns).
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
        # The same Runge-Kutta step for the tangents, whose slope at each stage is the Jacobian
        # at the stage's state times the tangent: the derivative of the discrete step itself.
        for block in range(blocks):
            rows = tangents[block * size : (block + 1) * size]
            for i in range(stages):
                for j in range(size):
                    for lane in range(lanes):
                        change = 0.0
                        for q in range(i):
                            change = fma(steps.a[i, q], room.rates[q * size + j, lane], change)
                        along[j, lane] = fma(length, change, rows[j, lane])
                field.time[0] = fma(steps.c[i], length, begin)
                rates = room.rates[i * size : (i + 1) * size]
                call(field.tangent, field.c, field.b, field.time, room.at[i], along, rates)
            for j in range(size):
                for lane in range(lanes):
                    change = 0.0
                    for q in range(stages):
                        change = fma(steps.b[q], room.rates[q * size + j, lane], change)
                    rows[j, lane] = fma(length, change, rows[j, lane])
    for k in range(columns):
        for j in range(size):
            matrix[j, k] = tangents[(k // lanes) * size + j, k % lanes]

"""Evaluate the equations of motion: f, its exact derivatives, and their flow over a period of time.

Derivatives of the flow are, up to rounding, exact for the discrete steps that were taken, not for
the continuous motion (Griewank and Walther, Evaluating Derivatives (2008), ch. 3): tangents are
stepped along with the state by the same method.
"""

import copy
from typing import Any, NamedTuple

import numpy as np

from ab_sim.engine.compiling import compiled
from ab_sim.engine.compiling.kinds import Floats, Table, aligned, call, fma
from ab_sim.engine.events.run_arrays import branches_of
from ab_sim.engine.integrate.registry import Stepper
from ab_sim.engine.kernels.code import called, caller, code_of, lanes_for, tangent_address
from ab_sim.engine.kernels.runge_kutta import Tableau
from ab_sim.model.dynamics.assemble import active_segment
from ab_sim.model.dynamics.system import DISCRETE_COLUMNS, System, has_events, layout_of
from ab_sim.model.spindle import ScheduledSegment


class Field(NamedTuple):
    """Equations of a scene, for calls from code in the subset of ``ab_sim.engine.compiling``."""

    slope: int
    """Address of slope(c, b, y, k, time); see ``ab_sim.engine.kernels``."""
    tangent: int
    """Address of tangent(c, b, t, y, d, out); see ``tangent_address``."""
    c: Floats
    """Constants."""
    b: Floats
    """Branches of set-valued laws."""
    time: Floats
    """Time for ``tangent``, shape (1,)."""
    lanes: int
    """Number of directions computed together."""


class VectorField:
    """Right-hand side f of y' = f(t, y), as used in runs, and its exact derivatives.

    f is smooth: it belongs to one segment of the profile, which is continued without end, and to
    fixed branches of set-valued laws. No event changes these here.

    Parameters
    ----------
    system
        System of equations.
    scheduled
        Segment of the speed profile.
    discrete_state
        Branches of set-valued laws, shape (n + 1, DISCRETE_COLUMNS).

    Raises
    ------
    ValueError
        The shape of ``discrete_state`` does not fit the number of balls.
    """

    def __init__(
        self, system: System, scheduled: ScheduledSegment, discrete_state: np.ndarray
    ) -> None:
        self.system, self.scheduled = system, scheduled
        self.layout = layout_of(system)
        """Names and positions of the states."""
        self.discrete_state = _shaped(
            "discrete_state", discrete_state, (len(system.balls) + 1, DISCRETE_COLUMNS), np.int64
        )
        self._code = code_of(system, type(scheduled.law))
        c = self._code.constants(system)
        self._code.put_place(c, active_segment(scheduled).numbers)
        self._c, self._b = c, branches_of(system, self.discrete_state)
        self._lanes, self._time = lanes_for(len(system.balls)), np.zeros(1)
        self._function = caller(4, 1)(self._code.address("slope"))
        self._pointers = self._c.ctypes.data, self._b.ctypes.data

    def at(self, scheduled: ScheduledSegment) -> "VectorField":
        """Return the same equations on another segment of the same kind.

        This takes a quarter of the time of a new object, or less.
        """
        other = copy.copy(self)
        other.scheduled, other._c = scheduled, aligned(self._c.shape)
        other._c[:] = self._c
        self._code.put_place(other._c, active_segment(scheduled).numbers)
        other._pointers = other._c.ctypes.data, other._b.ctypes.data
        return other

    @property
    def emitted(self) -> Field:
        """Equations for calls from compiled code."""
        code = self._code
        addresses = code.address("slope"), tangent_address(code)
        return Field(*addresses, self._c, self._b, self._time, self._lanes)

    def slope(self, time: float, state: np.ndarray) -> np.ndarray:
        """Return f, the state's time derivative, shape (states,).

        Parameters
        ----------
        time
            Time [s], with the same origin as the segment's start.
        state
            State, shape (states,).

        Raises
        ------
        ValueError
            The state has another shape.
        """
        at, out = self._state(state), np.empty(self.layout.size)
        self.fill(float(time), at, out)
        return out

    def fill(self, time: float, state: np.ndarray, out: np.ndarray) -> None:
        """Write ``slope`` to an array, without any checks, for frequent calls.

        Parameters
        ----------
        time
            Time [s].
        state
            State, shape (states,), contiguous.
        out
            Output, shape (states,), contiguous.
        """
        self._function(
            *self._pointers,
            state.__array_interface__["data"][0],
            out.__array_interface__["data"][0],
            time - self.scheduled.start,
        )

    def jacobian(self, time: float, state: np.ndarray) -> np.ndarray:
        """Return d f_i / d y_j, shape (states, states); arguments and errors as for ``slope``."""
        size = self.layout.size
        return self._along(time, state, np.eye(size, size + 1))

    def time_derivative(self, time: float, state: np.ndarray) -> np.ndarray:
        """Return d f_i / d t, shape (states,); arguments and errors as for ``slope``."""
        size = self.layout.size
        return self._along(time, state, np.eye(1, size + 1, size))[:, 0]

    def _along(self, time: float, state: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return derivatives of f along directions, one per line; shape (states, directions)."""
        at, address, lanes = self._state(state), tangent_address(self._code), self._lanes
        size, count = self.layout.size, len(directions)
        when, derivatives = np.array([float(time) - self.scheduled.start]), np.empty((size, count))
        along, out = np.zeros((size + 1, lanes)), np.empty((size, lanes))
        for first in range(0, count, lanes):
            these = directions[first : first + lanes]
            along[:, : len(these)] = these.T
            called(address, self._c, self._b, when, at, along, out)
            derivatives[:, first : first + len(these)] = out[:, : len(these)]
        return derivatives

    def _state(self, state: Any) -> np.ndarray:
        return _shaped("state", state, (self.layout.size,), np.float64)


def _shaped(name: str, value: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
    """Return a copy with the right type and shape, as compiled code does not check its input."""
    array: np.ndarray = np.array(value, kind, order="C")
    if array.shape != shape:
        raise ValueError(f"{name}: has shape {array.shape}; must have shape {shape}")
    return array


class Flown(NamedTuple):
    """Result of steps of a fixed length."""

    states: np.ndarray
    """State at the start and after each step, shape (steps + 1, states); angles include whole
    turns."""
    matrix: np.ndarray
    """Derivatives d end_i / d start_j, shape (states, columns)."""


class Flow:
    """Flow of a scene's equations in steps of a fixed length, and its exact derivative.

    Parameters
    ----------
    system
        System without events.
    scheduled
        Segment of the speed profile, continued without end.
    discrete_state
        Branches of set-valued laws, shape (n + 1, DISCRETE_COLUMNS).
    stepper
        Explicit Runge-Kutta method.

    Raises
    ------
    ValueError
        The system has events, at which the flow has kinks and jumps where steps would have to be
        cut; or the stepper is not an explicit Runge-Kutta method.
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

        Parameters
        ----------
        start
            Initial state, shape (states,).
        duration
            Duration [s].
        steps
            Number of steps.
        columns
            Number of entries of the initial state, from the first on, with respect to which
            derivatives are computed; default: all.
        """
        size = self.layout.size
        count = size if columns is None else columns
        flown = Flown(np.empty((steps + 1, size)), np.zeros((size, count)))
        flown.states[0] = start
        lanes, stages = self._steps.field.lanes, len(self._steps.b)
        room = _Room(
            np.empty((stages, size)),
            np.empty((stages, size)),
            np.zeros((-(-count // lanes), size * lanes)),
            np.zeros((size + 1) * lanes),
            np.empty((stages, size * lanes)),
        )
        compiled(_take_steps)(
            self._steps, room, duration / steps, count, flown.states, flown.matrix
        )
        return flown


class _Steps(NamedTuple):
    """Equations and method of the steps."""

    field: Field
    a: Table
    b: Floats
    c: Floats
    """Butcher tableau of the method, as in ``Tableau``."""


class _Room(NamedTuple):
    """Work arrays of the steps."""

    at: Table
    """States of the stages, shape (stages, states)."""
    slopes: Table
    """Slopes of the stages, shape (stages, states)."""
    tangents: Table
    """Tangents, shape (groups of lanes, states * lanes)."""
    along: Floats
    """Tangents of a stage, and the change of time; shape ((states + 1) * lanes,)."""
    rates: Table
    """Rates of the tangents, shape (stages, states * lanes)."""


def _take_steps(
    steps: _Steps, room: _Room, length: float, columns: int, states: Table, matrix: Table
) -> None:
    """Take steps from the first line of ``states`` on, together with tangents.

    Parameters
    ----------
    steps
        Equations and method.
    room
        Work arrays.
    length
        Length of a step [s].
    columns
        Number of derivatives.
    states
        Input and output, shape (steps + 1, states); the first line is the initial state.
    matrix
        Output, derivatives, shape (states, columns).
    """
    field, size, lanes = steps.field, states.shape[1], steps.field.lanes
    stages, tangents, along = steps.b.size, room.tangents, room.along
    for k in range(columns):
        tangents[k // lanes, k * lanes + k % lanes] = 1.0
    for s in range(states.shape[0] - 1):
        for i in range(stages):
            _add_slopes(states[s], length, steps.a[i, 0:i], room.slopes, room.at[i])
            field.time[0] = fma(steps.c[i], length, s * length)
            call(field.slope, field.c, field.b, room.at[i], room.slopes[i], field.time[0])
        _add_slopes(states[s], length, steps.b, room.slopes, states[s + 1])
        # The same Runge-Kutta step for the tangents, whose slope at each stage is the Jacobian
        # at the stage's state times the tangent: the derivative of the discrete step itself.
        for block in range(tangents.shape[0]):
            for i in range(stages):
                _add_slopes(tangents[block], length, steps.a[i, 0:i], room.rates, along)
                field.time[0] = fma(steps.c[i], length, s * length)
                at, rates = room.at[i], room.rates[i]
                call(field.tangent, field.c, field.b, field.time, at, along, rates)
            _add_slopes(tangents[block], length, steps.b, room.rates, tangents[block])
    for k in range(columns):
        for j in range(size):
            matrix[j, k] = tangents[k // lanes, j * lanes + k % lanes]


def _add_slopes(start: Floats, length: float, weights: Floats, slopes: Table, end: Floats) -> None:
    """Write to ``end`` a state plus ``length`` [s] times the weighted sum of slopes."""
    for j in range(start.size):
        change = 0.0
        for q in range(weights.size):
            change = fma(weights[q], slopes[q, j], change)
        end[j] = fma(length, change, start[j])

"""Evaluate the equations of motion: f, and its exact derivatives."""

import copy
from typing import Any, NamedTuple

import numpy as np

from ab_sim.engine.compiling.kinds import Floats, aligned
from ab_sim.engine.events.run_arrays import branches_of
from ab_sim.engine.kernels.code import called, caller, code_of
from ab_sim.engine.kernels.tangent import lanes_for, tangent_address
from ab_sim.model.dynamics.assemble import place_on
from ab_sim.model.dynamics.layout import layout_of
from ab_sim.model.dynamics.system import DISCRETE_COLUMNS, System
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

    Args:
        system: system of equations.
        scheduled: segment of the speed profile.
        discrete_state: branches of set-valued laws, shape (n + 1, DISCRETE_COLUMNS).

    Raises:
        ValueError: the shape of ``discrete_state`` does not fit the number of balls.
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
        self._code = code_of(system, type(scheduled.segment))
        place = place_on(scheduled)
        c = self._code.constants(system)
        self._code.put_place(c, [*place.segment, *place[1:]])
        self._c, self._b = c, branches_of(system, self.discrete_state)
        self._lanes, self._time = lanes_for(len(system.balls)), np.zeros(1)
        self._function = caller(4, 1)(self._code.address("slope"))
        self._pointers = self._c.ctypes.data, self._b.ctypes.data

    def at(self, scheduled: ScheduledSegment) -> "VectorField":
        """Return the same equations on another segment of the same kind, in a tenth of the time."""
        other = copy.copy(self)
        other.scheduled, other._c = scheduled, aligned(self._c.shape)
        other._c[:] = self._c
        place = place_on(scheduled)
        self._code.put_place(other._c, [*place.segment, *place[1:]])
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

        Args:
            time: time [s], with the same origin as the segment's start.
            state: state, shape (states,).

        Raises:
            ValueError: the state has another shape.
        """
        at, out = self._state(state), np.empty(self.layout.size)
        self.fill(float(time), at, out)
        return out

    def fill(self, time: float, state: np.ndarray, out: np.ndarray) -> None:
        """Write ``slope`` to an array, without any checks, for frequent calls.

        Args:
            time: time [s].
            state: state, shape (states,), contiguous.
            out: output, shape (states,), contiguous.
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

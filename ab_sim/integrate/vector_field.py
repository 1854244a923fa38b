"""The equations of motion for callers outside a kernel: f, and its exact derivatives."""

from typing import Any

import numpy as np

from ab_sim.dynamics.assemble import place_on
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.slope import evaluate
from ab_sim.dynamics.system import MODES, Plant, System, ball_count
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.jacobian import jacobian, time_derivative
from ab_sim.integrate.on_stack import own_room
from ab_sim.spindle import Piece


class VectorField:
    """f of y' = f(t, y), as the kernel that runs has it, and its exact derivatives.

    Smooth where the profile is: one piece of it, whose segment is taken to go on for ever. What
    has events has them at other branches than those given: here nothing switches.

    Args:
        system: what moves.
        piece: of the speed profile.
        modes: branches of set-valued laws in force, shape (n + 1, MODES).

    Raises:
        ValueError: the modes are not those of so many balls.
    """

    def __init__(self, system: System, piece: Piece, modes: np.ndarray) -> None:
        self.system, self.piece = system, piece
        self.layout = layout_of(system)
        """What the states are, and where."""
        self.modes = _shaped("modes", modes, (ball_count(system) + 1, MODES), np.int64)
        self._place = place_on(piece)

    def slope(self, time: float, state: np.ndarray) -> np.ndarray:
        """f: the state's time derivative, shape (states,).

        Args:
            time: s, counted as the piece's start is.
            state: shape (states,).

        Raises:
            ValueError: so many states there are not.
        """
        return self._of(slope_at, time, state, ())

    def jacobian(self, time: float, state: np.ndarray) -> np.ndarray:
        """d f_i / d y_j, shape (states, states); arguments and errors as of ``slope``."""
        return self._of(jacobian_at, time, state, (self.layout.size,))

    def time_derivative(self, time: float, state: np.ndarray) -> np.ndarray:
        """d f_i / d t, shape (states,); arguments and errors as of ``slope``."""
        return self._of(time_derivative_at, time, state, ())

    def _of(self, kernel: Any, time: float, state: Any, columns: tuple[int, ...]) -> np.ndarray:
        size = self.layout.size
        at, out = _shaped("state", state, (size,), np.float64), np.empty((size, *columns))
        kernel(self.system, self._place, float(time) - self.piece.start, at, self.modes, out)
        return out


def _shaped(name: str, given: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
    """A copy of the right kind: a kernel reads what lies at an address, whatever that is."""
    found: np.ndarray = np.array(given, kind, order="C")
    if found.shape != shape:
        raise ValueError(f"{name}: has the shape {found.shape}, must have {shape} here")
    return found


@compiled
def slope_at(system, place, time, state, modes, out):  # type: ignore[no-untyped-def]
    """``dynamics.slope.evaluate``: the state's time derivative at local ``time`` [s] into ``out``.

    Args:
        system, place, modes: of a Plant.
        time: s.
        state: the state.
        out: same shape.
    """
    room = own_room(system, ball_count(system), 0.0)
    evaluate(Plant(system, place, modes, room), time, state, out)


@compiled
def jacobian_at(system, place, time, state, modes, out):  # type: ignore[no-untyped-def]
    """``integrate.jacobian.jacobian`` into ``out``, shape (states, states); as ``slope_at``."""
    room = own_room(system, ball_count(system), 0.0)
    jacobian(Plant(system, place, modes, room), time, state, out)


@compiled
def time_derivative_at(system, place, time, state, modes, out):  # type: ignore[no-untyped-def]
    """``integrate.jacobian.time_derivative`` into ``out``; as ``slope_at``."""
    room = own_room(system, ball_count(system), 0.0)
    time_derivative(Plant(system, place, modes, room), time, state, out)

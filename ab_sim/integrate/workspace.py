"""Arrays that a run reuses, so that no step allocates."""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.dynamics.drag_response import table_rows
from ab_sim.dynamics.pools import POOL_WIDTH
from ab_sim.dynamics.scratch import WIDTH
from ab_sim.dynamics.switches import slots
from ab_sim.dynamics.system import System


class Workspace(NamedTuple):
    """What one step writes to."""

    slopes: np.ndarray
    """The stepper's stages, shape (rows, states); row 0 is the slope at the step's start."""
    trial: np.ndarray
    """The state at the step's end, shape (states,)."""
    ahead: np.ndarray
    """The slope there, shape (states,)."""
    scratch: np.ndarray
    """Shape (balls, WIDTH), and for a stepper with nodes as much again for each of them, and the
    tables of drag_response."""
    bounds: np.ndarray
    """Magnitudes that no sound run reaches, shape (states,)."""
    margin: np.ndarray
    """Margins at the step's start, shape (slots,)."""
    margin_ahead: np.ndarray
    """Margins at its end, shape (slots,)."""
    grain: np.ndarray
    """What of a margin may be rounding, shape (slots,)."""
    pools: np.ndarray
    """Balls that touch, at an instant, shape (balls, POOL_WIDTH); see dynamics/pools.py."""
    near: np.ndarray
    """A state and its slope shortly after another, shape (2, states)."""
    rates: np.ndarray
    """Rates of the margins at the step's start and end, and margins shortly after with what may be
    rounding, shape (4, slots)."""
    counts: np.ndarray
    """Events met; steps with events too many to locate, and instants at which no branches were
    found for all laws. Shape (2,)."""


def workspace(system: System, slopes: int, nodes: int, bounds: np.ndarray) -> Workspace:
    """A workspace for a system and a stepper that keeps ``slopes``, and balls at ``nodes``."""
    balls, states, margins = system.balls.shape[0], bounds.size, slots(system)
    return Workspace(
        aligned((slopes, states)),
        aligned((states,)),
        aligned((states,)),
        aligned(((1 + nodes) * balls + table_rows(balls, nodes), WIDTH)),
        bounds,
        aligned((margins,)),
        aligned((margins,)),
        aligned((margins,)),
        aligned((balls, POOL_WIDTH)),
        aligned((2, states)),
        aligned((4, margins)),
        np.zeros(2, np.int64),
    )


def aligned(shape: tuple[int, ...]) -> np.ndarray:
    """Zeros that begin at a cache line: numpy's own alignment costs 10 % or so, at random."""
    size = 8 * math.prod(shape)
    raw = np.zeros(size + 64, np.uint8)
    first = -raw.ctypes.data % 64
    return raw[first : first + size].view(np.float64).reshape(shape)

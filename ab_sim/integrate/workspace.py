"""Arrays that a run reuses, so that no step allocates."""

import math
from typing import Any, NamedTuple

import numba
import numpy as np

from ab_sim.dynamics.layout import equation_count, layout_of
from ab_sim.dynamics.numbers.kinds import EIGHT
from ab_sim.dynamics.race.margins import slots
from ab_sim.dynamics.race.pools import POOL_WIDTH
from ab_sim.dynamics.race.table import table_width
from ab_sim.dynamics.system import Room, System, carrier_unknowns
from ab_sim.integrate.stepper import Stepper


class Workspace(NamedTuple):
    """What one step writes to; K accelerations."""

    slopes: np.ndarray
    """The stepper's stages, shape (rows, states); row 0 is the slope at the step's start."""
    trial: np.ndarray
    """The state at the step's end, shape (states,)."""
    ahead: np.ndarray
    """The slope there, shape (states,)."""
    acceleration_ahead: np.ndarray
    """The accelerations there, shape (K,)."""
    room: Room
    """Of the evaluation at hand."""
    memory: np.ndarray
    """What a stepper carries from one step to the next, shape (rows, states); of one that takes
    spans the last one, shape (2 states + 2, 8)."""
    smooth: np.ndarray
    """When the piece of the profile begins that the memory belongs to [s]; NaN if it belongs to
    none, shape (1,)."""
    tables: np.ndarray
    """What it keeps for as long as it serves, shape (lines, 8)."""
    bounds: np.ndarray
    """Magnitudes that no sound run reaches, shape (states,)."""
    margin: np.ndarray
    """Margins at the step's start, shape (slots,)."""
    margin_ahead: np.ndarray
    """Margins at its end, shape (slots,)."""
    rate: np.ndarray
    """Rates of the margins at the step's start that are speeds or distances, shape (slots,)."""
    rate_ahead: np.ndarray
    """The same at its end, shape (slots,)."""
    rounding: np.ndarray
    """What of a margin may be rounding, shape (slots,)."""
    pools: np.ndarray
    """Balls that touch, at an instant, shape (balls, POOL_WIDTH); see dynamics/race/pools.py."""
    near: np.ndarray
    """A state and its slope shortly after another, shape (2, states)."""
    near_margin: np.ndarray
    """Margins, rounding and rates there, shape (3, slots)."""
    force_rate: np.ndarray
    """Rates of the margins that are forces, at the step's start and end, shape (2, slots)."""
    between: np.ndarray
    """Accelerations between those of two rounds of settling, shape (K,)."""
    counts: np.ndarray
    """Events met; steps with events too many to locate, and instants at which no branches were
    found for all laws. Shape (2,)."""


def workspace(system: System, stepper: Stepper, bounds: np.ndarray) -> Workspace:
    """A workspace for a system and a stepper.

    Args:
        system: what moves.
        stepper: says what it keeps within a step, and from one to the next.
        bounds: magnitudes that no sound run reaches, shape (states,).
    """
    balls, states = system.balls.shape[0], layout_of(system).size
    margins, accelerations = slots(balls), carrier_unknowns(system.carrier) + 1
    return Workspace(
        slopes=aligned((stepper.slopes, states)),
        trial=aligned((states,)),
        ahead=aligned((states,)),
        acceleration_ahead=aligned((accelerations,)),
        room=room(accelerations, balls),
        memory=aligned((2 * states + 2, EIGHT) if stepper.spans else (stepper.memory, states)),
        smooth=np.full(1, math.nan),
        tables=aligned((stepper.tables * (1 + equation_count(system)), EIGHT)),
        bounds=bounds,
        margin=aligned((margins,)),
        margin_ahead=aligned((margins,)),
        rate=aligned((margins,)),
        rate_ahead=aligned((margins,)),
        rounding=aligned((margins,)),
        pools=aligned((balls, POOL_WIDTH)),
        near=aligned((2, states)),
        near_margin=aligned((3, margins)),
        force_rate=aligned((2, margins)),
        between=aligned((accelerations,)),
        counts=np.zeros(2, np.int64),
    )


def room(accelerations: int, balls: int, *side_by_side: int) -> Room:
    """Room for evaluations.

    Args:
        accelerations: K.
        balls: how many.
        side_by_side: lengths of further axes.
    """
    table, block = (balls, table_width(accelerations)), (accelerations, accelerations + 1)
    shapes = table, block, block, (accelerations,), (3,)
    return Room(*(aligned((*shape, *side_by_side)) for shape in shapes))


def aligned(shape: tuple[int, ...]) -> np.ndarray:
    """Zeros that begin at a cache line: numpy's own alignment costs 10 % or so, at random."""
    size = 8 * math.prod(shape)
    raw = np.zeros(size + 64, np.uint8)
    first = -raw.ctypes.data % 64
    return raw[first : first + size].view(np.float64).reshape(shape)


def workspace_kind() -> object:
    """Numba's type of a Workspace, which is the same for all."""
    flat, table = np.zeros(0), np.zeros((0, 0))
    tables = {"slopes", "memory", "tables", "pools", "near", "near_margin", "force_rate"}
    values: dict[str, Any] = {name: table if name in tables else flat for name in Workspace._fields}
    values |= {"room": Room(table, table, table, flat, flat), "counts": np.zeros(0, np.int64)}
    return numba.typeof(Workspace(**values))

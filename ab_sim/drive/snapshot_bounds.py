"""Bounds that the numbers of a snapshot from a file must respect, as in any run of its scene."""

import math

import numpy as np

from ab_sim.base.errors import short
from ab_sim.base.numbers import MOST_TIME
from ab_sim.drive.observation import Snapshot
from ab_sim.model.dynamics.assemble import MOST_ANGLE, state_bounds, system_of
from ab_sim.model.dynamics.layout import layout_of
from ab_sim.model.dynamics.system import TURNS, has_motor
from ab_sim.model.spindle.speed_laws import RaisedCosine
from ab_sim.scene.model import Scene

MOST_TURNS = 2**53
"""Largest number of whole turns of an angle that a double represents exactly."""
MOST_MODE = 2
"""Largest magnitude of any other number of the discrete state."""
MOST_SLOPE = 1e12
"""Largest slope of a segment [rad/s^2]; commands within one step may exceed the scene's limit."""
ROUNDING = 1e-6
"""Relative margin for rounding of computed speeds and angles."""


def check_bounds(snapshot: Snapshot, scene: Scene) -> None:
    """Refuse a snapshot with a number that no run of its scene can reach.

    Raises:
        ValueError: a number is out of bounds; the message names it and its bounds.
    """
    system = system_of(scene)
    if snapshot.state.size > layout_of(system).size:
        system = system_of(scene, energy_balance=True)
    layout, top = layout_of(system), scene.spindle.max_speed
    bounds = state_bounds(system, scene.solver.step)
    bounds[layout.angles] = 2.0 * math.pi  # whole turns are counted separately
    if has_motor(system.effects):
        bounds[layout.spindle.start] = 2.0 * math.pi
    if snapshot.state.shape != bounds.shape:
        raise ValueError(f"state: has {snapshot.state.size} numbers; must have {bounds.size}")
    for name, value, most in zip(layout.names, snapshot.state, bounds, strict=True):
        _within(name, value, most)
    _within("steps", snapshot.steps, math.inf, least=0)
    for at, row in enumerate(np.atleast_2d(snapshot.discrete_state).tolist()):
        for column, mode in enumerate(row):
            _within(f"modes.{at}.{column}", mode, MOST_TURNS if column == TURNS else MOST_MODE)
    if snapshot.command is not None:
        _within("command", snapshot.command, top)
    _within("acceleration", snapshot.acceleration, scene.spindle.max_acceleration, least=0)
    numbers = [("memory", snapshot.memory)]
    numbers += [
        (f"pickups.{name}", part) for name, kept in snapshot.pickups.items() for part in kept
    ]
    for name, part in numbers:
        if not np.all(np.isfinite(part)):
            raise ValueError(f"{name}: has a number that is not finite")
    for at, piece in enumerate(snapshot.profile.segments):
        name = f"pieces.{at}"
        _within(f"{name}.start", piece.start, MOST_TIME)
        _within(f"{name}.start_angle", piece.start_angle, MOST_ANGLE)
        segment = piece.segment
        _within(f"{name}.start_speed", segment.start_speed, top)
        if isinstance(segment, RaisedCosine):
            _within(f"{name}.change", segment.change, 2.0 * top)
            _within(f"{name}.duration", segment.duration, MOST_TIME, least=0)
        else:
            _within(f"{name}.slope", segment.slope, MOST_SLOPE)
            if segment.slope != 0.0:
                change = segment.slope * (piece.end - piece.start)
                _within(f"{name}: speed at its end", segment.start_speed + change, top)


def _within(name: str, value: float, most: float, least: float | None = None) -> None:
    low = -most if least is None else least
    # A NaN fails this comparison.
    if not low * (1.0 + ROUNDING) <= value <= most * (1.0 + ROUNDING):
        raise ValueError(f"{name} = {short(float(value))}: must be {low:g} to {most:g}")

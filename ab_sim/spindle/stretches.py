"""Where steps go along a speed profile: they never run across a breakpoint, nor past a shape.

A ramp is resolved however short it is: in local time its speed is a polynomial. A curve is not: one
step over the whole of it takes a few values for its shape, and takes the same few whatever the
step is. So a curve that is shorter than the cycle of the fastest motion that steps follow is passed
in as many steps as such a cycle would be, each shorter by as much as the curve is. Half the step
halves them, too.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from ab_sim.spindle.profile import Piece, SpeedProfile
from ab_sim.spindle.segments import Ramp


class Grid(NamedTuple):
    """How fine steps are."""

    step: float
    """s."""
    cycle: float
    """Of the fastest motion that steps follow [s]: see ``integrate.choose.Choice``."""


class Stretch(NamedTuple):
    """Steps within one piece of a profile, or the part of a step that lies in it."""

    piece: Piece
    first: int
    """Steps taken before."""
    steps: int
    """Whole steps; 0 for a part of one."""
    offset: float
    """Where a part begins in its step [s]; 0 for whole steps."""
    length: float
    """Of each step, or of the part [s]."""


def same_instant(time: float, step: float) -> float:
    """How far apart two times may be and still be the same instant [s]."""
    return max(1e-9 * step, 4.0 * math.ulp(time))


def piece_after(profile: SpeedProfile, time: float, step: float) -> Piece:
    """The piece in force just after ``time`` [s]."""
    return profile.piece_at(time + same_instant(time, step))


def stretches(profile: SpeedProfile, grid: Grid, first: int, steps: int) -> Iterator[Stretch]:
    """The stretches of so many steps, ``first`` steps having been taken before.

    A step with breakpoints in it, or along a short curve, comes in parts, one after the other.
    """
    step, done = grid.step, 0
    while done < steps:
        at = first + done
        piece = piece_after(profile, at * step, step)
        whole = 0
        if _longest(piece, grid) == step:
            whole = _whole_steps(piece.end, step, at, steps - done)
        if whole:
            yield Stretch(piece, at, whole, 0.0, step)
        else:
            yield from parts(profile, grid, at, (at + 1) * step)
        done += max(whole, 1)


def parts(profile: SpeedProfile, grid: Grid, first: int, end: float) -> Iterator[Stretch]:
    """The parts from the beginning of a step to ``end`` [s], no later than the next step's."""
    begin = now = first * grid.step
    while True:
        piece = piece_after(profile, now, grid.step)
        until = piece.end if piece.end < end - same_instant(end, grid.step) else end
        count = max(1, math.ceil((until - now) / _longest(piece, grid) - 1e-9))
        length = (until - now) / count
        for k in range(count):
            yield Stretch(piece, first, 0, (now - begin) + k * length, length)
        if until == end:
            return
        now = until


def _longest(piece: Piece, grid: Grid) -> float:
    """How long a step may be along a piece [s]."""
    if isinstance(piece.segment, Ramp):
        return grid.step
    return grid.step * min(1.0, (piece.end - piece.start) / grid.cycle)


def _whole_steps(end: float, step: float, first: int, most: int) -> int:
    """Whole steps that end at or before ``end`` [s], at most ``most``."""
    ahead = (end - first * step) / step
    if ahead > most + 1:
        return most
    count = max(math.floor(ahead) - 1, 0)
    while count < most and (first + count + 1) * step <= end + same_instant(end, step):
        count += 1
    return count

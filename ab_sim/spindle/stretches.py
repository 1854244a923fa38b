"""Where steps go along a speed profile: they never run across a breakpoint."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from ab_sim.spindle.profile import Piece, SpeedProfile


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


def stretches(profile: SpeedProfile, step: float, first: int, steps: int) -> Iterator[Stretch]:
    """The stretches of so many steps, ``first`` steps having been taken before.

    A step with breakpoints in it comes in parts, one after the other.
    """
    done = 0
    while done < steps:
        at = first + done
        piece = piece_after(profile, at * step, step)
        whole = _whole_steps(piece.end, step, at, steps - done)
        if whole:
            yield Stretch(piece, at, whole, 0.0, step)
        else:
            yield from parts(profile, step, at, (at + 1) * step)
        done += max(whole, 1)


def parts(profile: SpeedProfile, step: float, first: int, end: float) -> Iterator[Stretch]:
    """The parts from the beginning of a step to ``end`` [s], no later than the next step's."""
    begin = now = first * step
    while True:
        piece = piece_after(profile, now, step)
        until = piece.end if piece.end < end - same_instant(end, step) else end
        yield Stretch(piece, first, 0, now - begin, until - now)
        if until == end:
            return
        now = until


def _whole_steps(end: float, step: float, first: int, most: int) -> int:
    """Whole steps that end at or before ``end`` [s], at most ``most``."""
    ahead = (end - first * step) / step
    if ahead > most + 1:
        return most
    count = max(math.floor(ahead) - 1, 0)
    while count < most and (first + count + 1) * step <= end + same_instant(end, step):
        count += 1
    return count

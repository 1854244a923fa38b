"""Vibration levels of the rig while its speed is held: figures 8, 12 and 14 of 2010."""

from typing import NamedTuple

import numpy as np

from ab_sim import Scene
from ab_sim.analysis.floquet import STARTS, TurnMap
from gallery.two_plane.rig import BEARINGS_AT, RPM, Unbalance, rig
from gallery.two_plane.rotor import scene_of, shaft_at

ASIDE = (0.0, 3.0)
"""Start of the balls; where they balance is looked for."""


class Level(NamedTuple):
    """A motion that repeats with the spindle."""

    of_maxima: float
    """(3): the mean of the largest displacements at the two bearings [m]."""
    of_mean: float
    """Largest of the mean of both displacements, over the turn [m]."""
    angles: np.ndarray
    """Of the balls from the light spot, at the start [rad], rising within +-pi."""
    stable: bool
    """Whether what is near comes back."""


def level_of(scene: Scene, start: str) -> Level | None:
    """The repeated motion that is found from a start; None where none is found."""
    turn = TurnMap(scene, scene.start.speed)
    orbit = turn.shoot(STARTS[start](turn))
    if orbit is None:
        return None
    each = [np.abs(shaft_at(orbit.states, height)) for height in BEARINGS_AT]
    # Balls' angles count from the heavy spot.
    angles = np.angle(-np.exp(1j * orbit.start[turn.layout.angles]))
    return Level(
        0.5 * sum(float(one.max()) for one in each),
        0.5 * float((each[0] + each[1]).max()),
        np.sort(angles),
        bool(np.abs(np.linalg.eigvals(orbit.monodromy)).max() < 1.0),
    )


def plain(unbalance: Unbalance, rpm: float) -> Level:
    """Without balls: linear, so there is one."""
    found = level_of(scene_of(rig(unbalance), rpm * RPM, ()), "balanced")
    assert found is not None
    return found


def balanced(unbalance: Unbalance, rpm: float) -> Level | None:
    """With balls, where they balance their plane as well as they can."""
    return level_of(scene_of(rig(unbalance), rpm * RPM, ASIDE), "balanced")


def together(unbalance: Unbalance, rpm: float) -> Level | None:
    """With balls that start at the heavy spot, as below the critical speeds."""
    p = rig(unbalance)
    return level_of(scene_of(p, rpm * RPM, (p.phase, p.phase)), "start")

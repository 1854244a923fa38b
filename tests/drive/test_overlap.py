"""Balls that overlap for want of contact: which, and from when on."""

import math
from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.drive.overlap import Overlap, OverlapAccumulator, overlaps_at_start, overlaps_text

BALL = {"mass": 1e-3, "radius": 1e-3}
TOUCH = 2 * math.asin(0.1)
"""Angle between balls of 1 mm that touch, on a race of 10 mm."""


def watched(scene: Any, time: np.ndarray, angles: Any, size: int) -> OverlapAccumulator:
    watch = OverlapAccumulator(scene)
    columns = np.column_stack(angles)
    for first in range(0, len(time), size):
        watch.look(time[first : first + size], columns[first : first + size])
    return watch


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_who_and_from_when_on(scene: Any, size: int) -> None:
    """Ball 2 comes to ball 0 from behind, and passes it between two samples to meet ball 1."""
    three = scene(balls={"count": 3, **BALL})
    time = np.arange(0.0, 10.0, 0.01)
    still = np.zeros_like(time)
    coming = -1.0 - 4 * math.pi + time
    watch = watched(three, time, (still, still + 1.0, coming), size)
    assert watch.overlaps is not None
    assert [overlap.balls for overlap in watch.overlaps] == [(0, 2), (1, 2)]
    meets = [overlap.since for overlap in watch.overlaps]
    assert meets == pytest.approx([1 - TOUCH, 2 - TOUCH], abs=0.01)
    assert overlaps_text(watch.overlaps) == f"balls 0 and 2, first at {meets[0]:.4g} s; 1 more pair"


@pytest.mark.parametrize("size", [1, 2, 100])
def test_who_passes_another_between_two_samples_was_in_its_place(scene: Any, size: int) -> None:
    time = np.arange(5.0)
    watch = watched(scene(), time, (0 * time, np.array([-1.5, -1.0, -0.5, 0.5, 1.0])), size)
    assert watch.overlaps == (Overlap((0, 1), 3.0),)


def test_who_cannot_overlap(scene: Any) -> None:
    """With contact; in races of their own; one ball. Nothing is claimed of balls without a size."""
    contact = {"ball_contact": {"restitution_coefficient": 0.5}}
    apart = {"ball_angles": [0.0, 1.0]}
    one = scene(balls={"count": 1})
    sizeless = scene(balls={"radius": None}, effects={"ball_spin": None})
    for other in (scene(effects=contact, start=apart), one, sizeless):
        watch = OverlapAccumulator(other)
        watch.look(np.zeros(1), np.zeros((1, other.balls.count)))
        assert watch.overlaps is None and not watch.possible
        assert overlaps_at_start(other) == "" and overlaps_text(watch.overlaps) == "-"


def test_at_the_start(scene: Any) -> None:
    assert overlaps_at_start(scene()) == "balls 0 and 1, first at 0 s"
    parted = scene(start={"ball_angles": [0.0, 1.0]})
    assert overlaps_at_start(parted) == "not at the start, but they can"


def test_of_a_run(scene: Any) -> None:
    """Balls a turn apart are in one place; those that a drive packs for contact are not."""
    run = Drive(scene(start={"ball_angles": [0.0, 2 * math.pi]})).advance(10)
    watch = OverlapAccumulator(scene())
    watch.take(run)
    assert watch.overlaps == (Overlap((0, 1), run["time"][0]),)

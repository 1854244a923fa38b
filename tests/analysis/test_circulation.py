"""Balls that circulate to the end of a run are told from those that come to rest on the rotor."""

import json
import math
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis import metrics_of, run_scene
from ab_sim.analysis.circulation import Circulation, CirculationMarks, circulation_of
from ab_sim.analysis.metrics.wording import angles_text, circulating_text
from ab_sim.drive.trajectory import Trajectory
from tests.analysis.made import made

STALLING = {
    "balls": {"count": 6, "mass": 4e-3},
    "effects": {"viscous_drag": {"coefficient": 0.05}},
    "spindle": {"max_speed": 1300.0, "max_acceleration": 1000.0},
    "profile": {"kind": "start_up", "acceleration": 400.0, "target_speed": 1152.0},
    "duration": 8.0,
}
"""Six balls of 4 g, which start at one place and stay there together."""


def turning(*angles: Any) -> Trajectory:
    """A spindle at 100 rad/s for 10 s, with balls at these angles."""
    channels = {f"ball_{k}_angle": angle for k, angle in enumerate(angles)}
    return made(balls=len(angles), step=1e-2, angle=lambda t: 100 * t, **channels)


def circulating(run: Trajectory, size: int) -> Circulation | None:
    """What samples show that come so many at a time."""
    marks = CirculationMarks(len(run))
    for first in range(0, len(run), size):
        part = Trajectory(run.channels, run.samples[first : first + size])
        marks.take(part["time"][None], part["angle"][None], part.ball_angles[None])
    return circulation_of(*marks.kept)[0]


@pytest.mark.parametrize("size", [1, 3, 334, 1001])
def test_who_circulates_and_how_fast(size: int) -> None:
    """One rests; one lags behind at 70 rad/s, one runs ahead at 130, both with a ripple."""
    run = turning(
        lambda t: -3.0 + 0.1 * np.sin(9 * t),
        lambda t: -30 * t + np.sin(30 * t),
        lambda t: 30 * t + np.sin(20 * t),
    )
    found = circulating(run, size)
    assert found is not None and found.balls == (1, 2)
    assert found.speeds == pytest.approx((70.0, 130.0), abs=0.2)
    assert found.spindle_speed == pytest.approx(100.0)


@pytest.mark.parametrize(
    "angle",
    [
        lambda t: -300 * (1 - np.exp(-t / 5)),  # it is being caught up with
        lambda t: 40 * np.sin(t),  # there and back
        lambda t: -0.5 * t,  # less than a turn in a third
        lambda t: 0 * t,
    ],
)
def test_who_comes_to_rest_or_may_does_not_circulate(angle: Any) -> None:
    run = turning(angle)
    assert circulating(run, len(run)) is None


@pytest.mark.parametrize("count", [1, 2, 3])
def test_of_few_samples_nothing_is_said(count: int) -> None:
    assert circulating(turning(lambda t: -3000 * t).last(count), count) is None


def test_balls_that_stall_near_the_critical_speed_are_named(scene: Any) -> None:
    """The rotor turns at 1152 rad/s, its critical speed is 100 rad/s: there they stay."""
    metrics = run_scene(scene(**STALLING)).metrics
    found = metrics.circulating
    assert found is not None and found.balls == (0, 1, 2, 3, 4, 5)
    assert all(90.0 < speed < 100.0 for speed in found.speeds)
    report = json.loads(json.dumps(metrics.report(1e-4)))["circulating_balls"]
    assert report["balls"] == [0, 1, 2, 3, 4, 5]
    assert report["spindle_speed"] == pytest.approx(1152.0)
    assert circulating_text(found, 6).startswith("6 of 6 at 9")
    assert angles_text(metrics.final_ball_angles, found) == "none rests"


def test_who_rests_beside_them_has_a_place(scene: Any) -> None:
    metrics = metrics_of(turning(lambda t: 0 * t - 1.0, lambda t: -30 * t), scene())
    circulating = metrics.circulating
    assert circulating_text(circulating, 2) == "1 of 2 at 70 rad/s, the spindle at 100"
    assert angles_text(metrics.final_ball_angles, circulating) == "-57.3, - deg"


def test_balls_at_rest_on_the_rotor_are_not(scene: Any) -> None:
    rested = metrics_of(turning(lambda t: 0 * t - math.pi, lambda t: 0 * t - math.pi), scene())
    assert rested.circulating is None and rested.report(1e-4)["circulating_balls"] is None
    assert circulating_text(rested.circulating, 2) == "-"
    assert angles_text(rested.final_ball_angles, rested.circulating) == "-180.0, -180.0 deg"

"""Two drives on one domain, as the README says: a namespace each, and a clock in it."""

from pathlib import Path
from typing import Any

import pytest

from ab_msgs_py import JointSample, Level, topics
from tests.nodes.fleet import Fleet
from tests.recorded import read_recording

pytestmark = pytest.mark.ros

SIDES = {"left": 0.001, "right": 0.002}
"""Masses of the balls."""


def levels(fleet: Fleet) -> set[Level]:
    return {health.level for health in fleet.healths}


def test_two_drives_know_nothing_of_each_other(fleet: Fleet, tmp_path: Path) -> None:
    joints: dict[str, list[Any]] = {}
    for side, mass in SIDES.items():
        joints[side] = fleet.listen(topics.JOINT_STATES._replace(name=f"{side}/joint_states"))
        fleet.start(f"{side}/recorder", path=tmp_path / f"{side}.rrd")
        fleet.start(f"{side}/drive_sim", scene="thesis-hold", changes=f"['balls.mass={mass}']")
        fleet.start(f"{side}/profile_controller", profile="thesis-hold", use_sim_time=True)

    def speed(side: str) -> float:
        return JointSample.of(joints[side][-1]).spindle_speed if joints[side] else 0.0

    for side in SIDES:
        fleet.until(lambda side=side: fleet.value(f"{side}/recorder", "file"), "it records")
    fleet.until(lambda: fleet.call("left/profile_controller/start")[0], "the left one starts")
    fleet.until(lambda: speed("left") > 4.0, "the left one turns")
    assert speed("right") == 0.0, "the right one does not"
    fleet.until(lambda: fleet.call("right/profile_controller/start")[0], "the right one starts")
    fleet.until(lambda: speed("right") > 2.0, "the right one turns")
    assert Level.ERROR not in levels(fleet), "neither is taken for the other"
    for node in ("profile_controller", "drive_sim", "recorder"):
        for side in SIDES:
            assert fleet.stop(f"{side}/{node}") == 0
    for side, mass in SIDES.items():
        recorded = read_recording(tmp_path / f"{side}.rrd")
        assert recorded.complete and recorded.missing == 0
        assert recorded.description["scene"]["balls"]["mass"] == mass
        own = [event.text for event in recorded.events if "profile" in event.text]
        assert any("profile: running" in text for text in own)


def test_a_second_simulator_on_the_same_clock_is_seen(fleet: Fleet) -> None:
    """Under the name that the clock has been given."""
    fleet.start("left/drive_sim", scene="thesis-hold")
    fleet.until(lambda: fleet.health("left/drive_sim"), "it is up")
    other = topics.CLOCK._replace(name="/left/clock").publisher(fleet.node)
    fleet.until(lambda: Level.ERROR in levels(fleet), "an error")
    health = fleet.health("left/drive_sim")
    assert health is not None
    assert health.message.startswith("another simulator publishes /left/clock")
    fleet.node.destroy_publisher(other)

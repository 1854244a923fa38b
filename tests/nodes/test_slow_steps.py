"""A drive whose steps take long, or never end: emergency stop, SIGTERM."""

import signal

import pytest
from std_srvs.srv import Trigger

from ab_msgs_py import JointSample, topics
from tests.nodes.fleet import Fleet
from tests.nodes.slow_to_step import GOES_ON, MODULE, SPEED, STALLS

pytestmark = pytest.mark.ros


def stalled(fleet: Fleet, seconds: str) -> None:
    """Start a drive, and wait until it is in a step that takes so long."""
    fleet.start("drive_sim", MODULE, seconds, scene="thesis-hold")
    fleet.until(lambda: fleet.value("drive_sim", "speed set by"), "it is up")
    fleet.client(Trigger, "drive_sim/emergency_stop")  # discovery takes as long as some steps
    fleet.command(SPEED)
    fleet.reads("drive_sim", STALLS)


def test_a_step_that_never_ends(fleet: Fleet) -> None:
    stalled(fleet, "1e6")
    stops, words = fleet.call("drive_sim/emergency_stop")
    assert stops and words.startswith("stopping after the step in progress")
    assert fleet.stop("drive_sim", signal.SIGTERM) == 1, "the first signal"
    assert "a step has taken" in fleet.log("drive_sim")
    fleet.until(lambda: "drive_sim" not in fleet.node.get_node_names(), "it has left the graph")


def test_a_step_that_takes_seconds(fleet: Fleet) -> None:
    joints = fleet.listen(topics.JOINT_STATES)
    stalled(fleet, "8")
    stops, _ = fleet.call("drive_sim/emergency_stop")
    assert stops and GOES_ON not in fleet.log("drive_sim"), "while it takes the step"
    fleet.until(
        lambda: fleet.value("drive_sim", "speed set by") == "emergency stop", "it takes effect"
    )
    fleet.until(lambda: JointSample.of(joints[-1]).spindle_speed == 0.0, "it stands")
    assert fleet.call("drive_sim/emergency_stop") == (True, "stopped already")
    assert fleet.stop("drive_sim", signal.SIGTERM) == 0

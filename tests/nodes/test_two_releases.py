"""Jazzy and Kilted (Fast DDS 2 and 3) together: a drive of one, a controller of the other."""

import sys
from pathlib import Path

import pytest

from ab_msgs_py import JointSample, topics
from ab_sim.nodes import discovery
from tests.nodes.fleet import Fleet

ROOT = Path(__file__).parents[2]
OTHER = ROOT / {2: ".venv", 3: ".venv-jazzy"}.get(discovery.fast_dds(), "")
"""Environment of the other release."""
pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(
        not (OTHER / "dev.stamp").exists(),
        reason=f"only one release is installed: no {OTHER.name}; make {OTHER.name}/dev.stamp"
        + (" ROS=jazzy" if OTHER.name == ".venv-jazzy" else ""),
    ),
]
OURS = (
    "LD_LIBRARY_PATH",
    "PYTHONPATH",
    "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
    *(variable for variable, _ in discovery.PROFILES.values()),
)
"""Variables that would lead the other release to libraries and settings of this one."""


def start(fleet: Fleet, node: str, there: bool, **parameters: object) -> None:
    """Start a node, there with the other release."""
    if not there:
        fleet.start(node, **parameters)
        return
    without = [word for name in OURS for word in ("-u", name)]
    settings = [part for k, v in parameters.items() for part in ("-p", f"{k}:={v}")]
    python = OTHER / "bin" / "python"
    fleet.start_process(
        node, "env", *without, f"AMENT_PREFIX_PATH={OTHER}", python, "-m", f"ab_sim.nodes.{node}",
        "--ros-args", *settings,
    )  # fmt: skip


@pytest.mark.parametrize("other", ["drive_sim", "profile_controller"])
def test_releases_talk_to_each_other(fleet: Fleet, other: str) -> None:
    """Topics, services, parameters, diagnostics, and the trajectory of a start-up."""
    assert Path(sys.prefix) != OTHER
    joints, blocks = fleet.listen(topics.JOINT_STATES), fleet.listen(topics.BLOCK)
    start(fleet, "drive_sim", other == "drive_sim", scene="balanced-start-up")
    start(
        fleet, "profile_controller", other == "profile_controller", profile="balanced-start-up",
        use_sim_time=True,
    )  # fmt: skip
    fleet.until(lambda: fleet.call("profile_controller/start")[0], "the controller starts")
    fleet.until(
        lambda: joints and JointSample.of(joints[-1]).spindle_speed == 200.0, "the final speed"
    )
    fleet.until(
        lambda: fleet.value("drive_sim", "last trajectory") == "followed", "it is acknowledged"
    )
    fleet.until(lambda: blocks and fleet.health("profile_controller"), "blocks and diagnostics")
    assert fleet.set("profile_controller", profile="no-ball")[0]
    assert fleet.stop("profile_controller") == 0  # it would continue to command 200 rad/s
    fleet.command(150.0)
    fleet.until(lambda: JointSample.of(joints[-1]).spindle_speed == 150.0, "the commanded speed")
    assert fleet.set("drive_sim", speed_factor=-1.0)[0] is False
    assert fleet.call("drive_sim/pause", True) == (True, "paused")
    assert fleet.change("drive_sim", "deactivate") and fleet.state("drive_sim") == "inactive"
    assert fleet.stop("drive_sim") == 0

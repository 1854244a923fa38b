"""Plug-ins in nodes: an installed package, and the parameter `load`."""

import json
import os
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS 2")

from ab_msgs_py import topics  # noqa: E402 - it needs rclpy
from tests.nodes.conftest import fleet  # noqa: E402, F401
from tests.nodes.fleet import Fleet  # noqa: E402
from tests.plug_ins.conftest import FILE  # noqa: E402

CHANGES = json.dumps(
    ["effects.wind.force=0.01", "solver.stepper=heun_of_tests", "solver.step=1e-4"]
)


def test_a_node_knows_an_installed_package(fleet: Fleet, installed: Path) -> None:  # noqa: F811
    fleet.environment["PYTHONPATH"] = str(installed)
    whirl = fleet.listen(topics.WHIRL)
    changes = f"changes:={CHANGES}"
    node = [sys.executable, "-m", "ab_sim.nodes.drive_sim", "--ros-args", "-p", changes]
    fleet.start_process("drive_sim", *node)
    fleet.until(lambda: whirl and whirl[-1].point.x > 1e-6, "the wind blows")


def test_nodes_load_a_file(fleet: Fleet) -> None:  # noqa: F811
    load = json.dumps([os.path.relpath(FILE)])
    whirl = fleet.listen(topics.WHIRL)
    fleet.start("drive_sim", load=load, changes=CHANGES)
    fleet.start("profile_controller", load=load, changes=CHANGES)
    fleet.until(lambda: whirl and whirl[-1].point.x > 1e-6, "the wind blows")
    fleet.reads("profile_controller", "waiting for ~/start")


def test_a_node_refuses_a_file_that_it_cannot_load(fleet: Fleet) -> None:  # noqa: F811
    node = fleet.start("drive_sim", load="[no_such_file.py]")
    assert node.wait(60) == 2
    assert "parameter load = no_such_file.py: must be a Python file" in fleet.log("drive_sim")

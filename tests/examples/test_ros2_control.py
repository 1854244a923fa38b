"""The example with ros2_control, as far as it can be read without ros2_control."""

import ast
from pathlib import Path

import yaml

from ab_sim.drive.urdf import urdf_of
from ab_sim.scene import load_scene

EXAMPLE = Path(__file__).parents[2] / "examples/ros2_control"


def test_controllers_are_of_the_spindle_and_the_launch_file_loads_them() -> None:
    content = yaml.safe_load((EXAMPLE / "controllers.yaml").read_text())
    (joint,) = content["velocity_controller"]["ros__parameters"]["joints"]
    urdf = urdf_of(load_scene("thesis-hold"), ros2_control=True)
    assert f'<joint name="{joint}">\n      <command_interface name="velocity">' in urdf
    controllers = content.keys() - {"controller_manager"}
    texts = {
        node.value
        for node in ast.walk(ast.parse((EXAMPLE / "drive.launch.py").read_text()))
        if isinstance(node, ast.Constant)
    }
    assert controllers <= texts and "--ros2-control" in texts


def test_the_drive_starts_last() -> None:
    """If a package is missing, launch leaves running what it has started before."""
    tree = ast.parse((EXAMPLE / "drive.launch.py").read_text())
    names = [
        node.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.keyword) and node.arg == "executable"
        if isinstance(node.value, ast.Constant)
    ]
    assert len(names) == 4 and names[-1] == "drive_sim"

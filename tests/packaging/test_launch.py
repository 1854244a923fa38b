"""The launch files under ROS's own launch, where there is one: PyPI has no wheel of it.

It is pure Python: sources of ros2/launch and ros2/launch_ros do, too. `make help` says how.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

if find_spec("launch_ros") is None:
    pytest.skip(
        "PyPI has no launch_ros: needs a distribution's ROS 2, or the sources of launch and "
        "launch_ros (`make help` says how to name them)",
        allow_module_level=True,
    )

from ab_msgs_py import JointSample, topics  # noqa: E402
from tests.nodes.conftest import fleet, no_screen  # noqa: E402
from tests.nodes.fleet import Fleet  # noqa: E402
from tests.recorded import read_recording  # noqa: E402

__all__ = ["fleet", "no_screen"]
pytestmark = pytest.mark.ros

ROOT = Path(__file__).parents[2]
Launch = Callable[..., None]
"""Given a launch file's name, and arguments."""
RUN = """
import importlib.util
import sys
import types

if importlib.util.find_spec("composition_interfaces") is None:
    # Messages that load nodes into a process, of which there is no wheel: launch_ros imports them,
    # and names their types in hints; nobody here uses them.
    load = types.SimpleNamespace(Request=None, Response=None)
    sys.modules["composition_interfaces"] = types.ModuleType("composition_interfaces")
    sys.modules["composition_interfaces.srv"] = types.ModuleType("composition_interfaces.srv")
    sys.modules["composition_interfaces.srv"].LoadNode = load
    sys.modules["composition_interfaces"].srv = sys.modules["composition_interfaces.srv"]

from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource

file, *given = sys.argv[1:]
arguments = [tuple(argument.split(":=", 1)) for argument in given]
source = PythonLaunchDescriptionSource(file)
service = LaunchService()
included = IncludeLaunchDescription(source, launch_arguments=arguments)
service.include_launch_description(LaunchDescription([included]))
sys.exit(service.run())
"""


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Installed tree, where launch looks for a package; before the fleet, which hands it on."""
    prefix = tmp_path / "prefix"
    index = prefix / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "ab_sim").touch()
    (prefix / "lib").mkdir()
    (prefix / "lib/ab_sim").symlink_to(ROOT / "scripts")
    (prefix / "share/ab_sim").symlink_to(ROOT)
    for name, first in (("AMENT_PREFIX_PATH", prefix), ("PATH", Path(sys.executable).parent)):
        known = filter(None, [str(first), os.environ.get(name, "")])
        monkeypatch.setenv(name, os.pathsep.join(known))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    return prefix


@pytest.fixture
def launch(prefix: Path, fleet: Fleet) -> Iterator[Launch]:
    started: list[subprocess.Popen[bytes]] = []

    def start(name: str, *arguments: str) -> None:
        file = ROOT / "launch" / name
        fleet.start_process("launch", sys.executable, "-c", RUN, file, *arguments)
        started.append(fleet.processes["launch"])

    yield start
    for process in started:
        if process.poll() is None:  # killed, it would leave its nodes behind
            process.send_signal(signal.SIGINT)
            process.wait(60.0)


def fast(messages: list[Any], speed: float) -> bool:
    return bool(messages) and JointSample.of(messages[-1]).spindle_speed > speed


def test_a_start_up_with_all_arguments(launch: Launch, fleet: Fleet, tmp_path: Path) -> None:
    parameters = tmp_path / "mine.yaml"
    parameters.write_text("/**/drive_sim:\n  ros__parameters: {wake_rate: 100.0, scene: no-ball}\n")
    joints = fleet.listen(topics.JOINT_STATES._replace(name="left/joint_states"))
    file = tmp_path / "run.rrd"
    launch(
        "startup.launch.py",
        "scene:=thesis-hold",
        "profile:=balanced-start-up",
        "changes:=['balls.mass=0.002', 'rotor.eccentricity=1e-4']",
        f"params_file:={parameters}",
        f"path:={file}",
        "namespace:=left",
    )
    fleet.until(lambda: fast(joints, 20.0), "it starts up by itself")
    fleet.until(lambda: fleet.value("left/drive_sim", "scene"), "it reports, once a second")
    assert fleet.value("left/drive_sim", "scene") == "thesis-hold", "arguments go first"
    stamps = [JointSample.of(message).time for message in joints]
    assert 10_000_000 in np.diff(stamps), "the file's wake_rate"
    fleet.stop("launch")
    recorded = read_recording(file)
    assert recorded.complete and recorded.description["scene"]["balls"]["mass"] == 0.002


def test_two_drives(launch: Launch, fleet: Fleet) -> None:
    sides = ("left", "right")
    joints = {
        side: fleet.listen(topics.JOINT_STATES._replace(name=f"{side}/joint_states"))
        for side in sides
    }
    launch("two_drives.launch.py", "right:=no-ball")
    fleet.until(lambda: all(fast(joints[side], 2.0) for side in sides), "both start up")
    assert [len(joints[side][-1].name) for side in sides] == [3, 1], "a scene each"
    fleet.stop("launch")


def test_without_ros2_control_its_example_starts_no_drive(launch: Launch, fleet: Fleet) -> None:
    launch("../examples/ros2_control/drive.launch.py")
    fleet.ended("launch")
    assert "package 'robot_state_publisher' not found" in fleet.log("launch")
    assert "process started" not in fleet.log("launch")


@pytest.mark.parametrize(
    ("argument", "words"),
    [("scene:=nowhere", "scene 'nowhere' is not known"), ("changes:=balls.mas=1", "did you mean")],
)
def test_a_drive_that_fails_ends_the_launch(
    launch: Launch, fleet: Fleet, argument: str, words: str
) -> None:
    launch("startup.launch.py", "profile:=thesis-hold", argument)
    fleet.ended("launch")
    assert words in fleet.log("launch")
    assert "drive_sim-1] was required" in fleet.log("launch")


def test_not_headless_a_window_is_asked_for_and_no_file_kept(
    no_screen: None, launch: Launch, fleet: Fleet
) -> None:
    """Where there is no screen it says so, and the drive goes on."""
    launch("startup.launch.py", "scene:=no-ball", "headless:=false")
    said = "could not start: there is no screen"
    fleet.until(lambda: said in fleet.value("recorder", "viewer state"), said)
    fleet.until(lambda: fleet.value("recorder", "file"), "it has heard the drive")
    file = Path(fleet.value("recorder", "file"))
    assert file.exists() and not file.is_relative_to(ROOT)
    fleet.stop("launch")
    assert not file.exists(), "only for the time of watching"

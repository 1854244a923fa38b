"""Words that a node is started with are heeded, or refused; none is passed over."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS 2")

from ab_sim.nodes.parameters import ParameterSpec  # noqa: E402 - it imports rclpy

UP = {
    "profile_controller": "waiting for ~/start",
    "recorder": "as soon as a drive describes itself",
}
"""What a node logs when it has taken its parameters."""


class Started:
    """A node started with arguments as they are typed."""

    def __init__(self, domain: int, node: str, *arguments: str) -> None:
        self.node = node
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"ab_sim.nodes.{node}", *arguments],
            env={
                **os.environ,
                "ROS_DOMAIN_ID": str(domain),
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def lines(self) -> Iterator[str]:
        """What it prints, until it ends."""
        assert self._process.stdout is not None
        return iter(self._process.stdout)

    def refusal(self) -> str:
        """What it says when it ends by itself, because of its arguments."""
        text = "".join(self.lines())
        assert self._process.wait(timeout=60) == 2, text
        assert "Traceback" not in text
        return text

    def comes_up(self) -> bool:
        """Whether it takes its parameters; it is ended then."""
        up = any(UP[self.node] in line for line in self.lines())
        self._process.send_signal(signal.SIGINT)
        rest = "".join(self.lines())
        assert self._process.wait(timeout=60) == (0 if up else 2), rest
        return up


@pytest.mark.parametrize(
    ("node", "word", "words"),
    [
        ("drive_sim", "scne:=on-edge", "parameter scne: /drive_sim has none of that name; did you"),
        ("drive_sim", "wake_rat:=100", "did you mean 'wake_rate'?; it has"),
        ("profile_controller", "profil:=no-ball", "did you mean 'profile'?"),
        ("recorder", "pathh:=run.rrd", "did you mean 'path'?"),
    ],
)
def test_a_parameter_that_is_not_there(domain: int, node: str, word: str, words: str) -> None:
    assert words in Started(domain, node, "--ros-args", "-p", word).refusal()


@pytest.mark.parametrize(
    ("unit", "words"), [("1", "a number from 1 to 2000"), ("1/s", "a number from 1 to 2000 1/s")]
)
def test_a_ratio_is_told_without_a_unit(unit: str, words: str) -> None:
    assert ParameterSpec("rate", 250.0, unit, (1.0, 2000.0)).allowed_text == words


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["scene:=on-edge"], "'scene:=on-edge': is not known; parameters come after --ros-args"),
        (["scene:=on-edge"], "`--ros-args -p scene:=on-edge`"),
        (["--scene", "on-edge"], "'--scene': is not known"),
        (["--ros-args", "scene:=on-edge"], "`--ros-args -p name:=value`"),
        (["--ros-args", "-p", "scene=on-edge"], "ROS does not understand them"),
        (["--ros-args", "-p", "scene:=no-ball", "--", "fast"], "'fast': is not known"),
    ],
)
def test_words_that_are_no_parameters(domain: int, arguments: list[str], words: str) -> None:
    assert words in Started(domain, "drive_sim", *arguments).refusal()


SHARED = """
/**:
  ros__parameters:
    use_sim_time: true
/left/profile_controller:
  ros__parameters: {profile: no-ball}
/**/profile_controller:
  ros__parameters: {command_rate: 100}
/**/drive_sim:
  ros__parameters: {scene: no-ball, changes: []}
/arm:
  ros__parameters: {joints: 6}
"""


@pytest.mark.parametrize("namespace", ["/left", "/"])
def test_a_file_may_hold_parameters_of_other_nodes(
    domain: int, namespace: str, tmp_path: Path
) -> None:
    file = tmp_path / "all.yaml"
    file.write_text(SHARED)
    arguments = ["--ros-args", "--params-file", str(file), "-r", f"__ns:={namespace}"]
    arguments += ["-p", "drive_sim:wake_rate:=100"]
    assert Started(domain, "profile_controller", *arguments).comes_up()


def test_a_slip_in_a_file_is_found_in_a_namespace_too(domain: int, tmp_path: Path) -> None:
    file = tmp_path / "slip.yaml"
    file.write_text("/left/recorder:\n  ros__parameters: {qeue: 10}\n")
    arguments = ["--ros-args", "--params-file", str(file), "-r"]
    refused = Started(domain, "recorder", *arguments, "__ns:=/left").refusal()
    assert "parameter qeue: /left/recorder has none of that name; did you mean 'queue'?" in refused
    assert Started(domain, "recorder", *arguments, "__ns:=/right").comes_up(), "not its own"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "is a folder; name a file"),
        ("hold.png", "must end in .rrd"),
        ("full.rrd", "is a device or a pipe; name a file"),
        ("no/file.txt", "must end in .rrd"),
    ],
)
def test_a_recording_goes_to_a_file_of_its_kind(
    domain: int, name: str, words: str, tmp_path: Path
) -> None:
    (tmp_path / "full.rrd").symlink_to("/dev/full")
    (tmp_path / "hold.png").write_text("a picture")
    before = sorted(tmp_path.iterdir())
    path = tmp_path / name
    refused = Started(domain, "recorder", "--ros-args", "-p", f"path:={path}").refusal()
    assert f"parameter path = {path}: {words}" in refused
    assert sorted(tmp_path.iterdir()) == before

"""Words that a node is started with are heeded, or refused; none is passed over."""

import os
import signal
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS 2")

from ab_sim.nodes.parameters import ParameterSpec  # noqa: E402 - it imports rclpy
from tests.forked.node import ForkedNode  # noqa: E402
from tests.waiting import PATIENCE, until  # noqa: E402

WHIRL = "qos_overrides./whirl.publisher"

UP = {
    "drive_sim": "configuring",
    "profile_controller": "waiting for ~/start",
    "recorder": "from the description of a drive on",
}
"""What a node logs when it has taken its parameters."""


class Started:
    """A node started with arguments as they are typed."""

    def __init__(self, domain: int, folder: Path, node: str, *arguments: str) -> None:
        self._node, self._log = node, folder / f"{node}.log"
        environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }
        self._process = ForkedNode(f"ab_sim.nodes.{node}", [*arguments], environment, self._log)

    def refusal(self) -> str:
        """Return the output of a node that ends by itself, because of its arguments."""
        code, text = self._process.wait(timeout=PATIENCE), self._log.read_text()
        assert code == 2, text
        assert "Traceback" not in text
        return text

    def comes_up(self) -> bool:
        """Return whether the node takes its parameters, and end it."""

        def is_up() -> bool:
            return UP[self._node] in self._log.read_text()

        until(lambda: is_up() or self._process.poll() is not None, "it is up, or refuses")
        up = is_up()
        self._process.send_signal(signal.SIGINT)
        assert self._process.wait(timeout=PATIENCE) == (0 if up else 2), self._log.read_text()
        return up


@pytest.mark.parametrize(
    ("node", "parameters", "words"),
    [
        ("drive_sim", ["scne:=on-edge"], "scne: /drive_sim has none of that name; did you"),
        ("drive_sim", ["wake_rat:=100"], "did you mean 'wake_rate'?; it has"),
        ("profile_controller", ["profil:=no-ball"], "did you mean 'profile'?"),
        ("recorder", ["pathh:=run.rrd"], "did you mean 'path'?"),
        ("drive_sim", ["scene:=thesis-hlod"], "did you mean 'thesis-hold'"),
        ("drive_sim", ["scene:=3.5"], "parameter scene = 3.5: must be a text"),
        ("drive_sim", ["changes:=['balls.mass=-1']"], "balls.mass = -1: must be at least 1e-12"),
        ("drive_sim", ["wake_rate:=300.0"], "use a rate of 333.333 1/s"),
        ("drive_sim", ["wake_rate:=1e9"], "parameter wake_rate"),
        ("drive_sim", ["wake_rate:=fast"], "wake_rate = 'fast': must be a number from 1 to 2000"),
        ("drive_sim", ["block_rate:=60.0"], "use a rate of 62.5 1/s"),
        ("drive_sim", ["publish_rate:=500.0"], "period of publish_rate: 0.002 s must be a whole"),
        (
            "recorder",
            ["use_sim_time:=1"],
            "'use_sim_time' to '1' of type 'INTEGER'",
        ),
        ("recorder", [f"keep:={5000 * 'a'}"], f"{98 * 'a'} ... {98 * 'a'}"),
        ("drive_sim", [f"{WHIRL}.reliability:=sure"], "must be reliable or best_effort"),
        ("drive_sim", [f"{WHIRL}.durability:=volatile"], "with one of .reliability, "),
        ("drive_sim", [f"{WHIRL}.depth:=0"], "= 0: must be a whole number from 1"),
        (
            "drive_sim",
            ["changes:=['solver.step=0.05']", "wake_rate:=20.0", "block_rate:=20.0"],
            "beyond the stability limit",
        ),
        (
            "drive_sim",
            ["patience:=0.01", "wake_rate:=50.0"],
            "patience = 0.01 s: must be at least 0.02 s",
        ),
        (
            "drive_sim",
            ["scene:=one-ball", "changes:=['accuracy.angle=1e-17', 'duration=1']"],
            "the best possible is about",
        ),
        ("recorder", ["view:=screen"], "parameter view: 'screen': must be web, native"),
        ("recorder", ["path:=/proc/no/run.rrd"], "its folder cannot be created"),
        ("profile_controller", ["profile:=nowhere.yaml"], "no such scene file"),
        ("profile_controller", ["command_rate:=0.0"], "parameter command_rate"),
    ],
)
def test_a_bad_parameter_ends_a_node_with_one_message(
    domain: int, tmp_path: Path, node: str, parameters: list[str], words: str
) -> None:
    given = [word for parameter in parameters for word in ("-p", parameter)]
    refusal = Started(domain, tmp_path, node, "--ros-args", *given).refusal()
    assert words in refusal and "[ERROR]" not in refusal


@pytest.mark.parametrize(
    ("unit", "words"), [("1", "a number from 1 to 2000"), ("1/s", "a number from 1 to 2000 1/s")]
)
def test_a_ratio_is_told_without_a_unit(unit: str, words: str) -> None:
    assert ParameterSpec("rate", 250.0, "", unit, (1.0, 2000.0)).allowed_text == words


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["scene:=on-edge"], "'scene:=on-edge': is unknown; parameters come after --ros-args"),
        (["scene:=on-edge"], "`--ros-args -p scene:=on-edge`"),
        (["--scene", "on-edge"], "'--scene': is unknown"),
        (["--ros-args", "scene:=on-edge"], "`--ros-args -p name:=value`"),
        (["--ros-args", "-p", "scene=on-edge"], "ROS does not understand them"),
        (["--ros-args", "-p", "scene:=no-ball", "--", "fast"], "'fast': is unknown"),
    ],
)
def test_words_that_are_no_parameters(
    domain: int, tmp_path: Path, arguments: list[str], words: str
) -> None:
    assert words in Started(domain, tmp_path, "drive_sim", *arguments).refusal()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (None, "Error opening YAML file"),
        ("drive_sim:\n  ros__parameters: {scene: &a no-ball, changes: [*a]}\n", "aliasing at line"),
        ("drive_sim: 3\n", "before ros__parameters at line 1"),
    ],
    ids=["missing", "alias", "no section"],
)
def test_a_parameter_file_that_ros_cannot_read(
    domain: int, tmp_path: Path, text: str | None, reason: str
) -> None:
    file = tmp_path / "mine.yaml"
    if text is not None:
        file.write_text(text)
    refusal = Started(
        domain, tmp_path, "drive_sim", "--ros-args", "--params-file", str(file)
    ).refusal()
    assert f"parameter file {file}: ROS cannot read it: " in refusal and reason in refusal
    assert ".c:" not in refusal.splitlines()[-1], "without the place in rcl's source"


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
    assert Started(domain, tmp_path, "profile_controller", *arguments).comes_up()


def test_a_parameter_for_all_nodes_may_be_of_others(domain: int, tmp_path: Path) -> None:
    file = tmp_path / "all.yaml"
    shared = "{joints: 6, arm: {length: 1.0}, pathh: a.rrd, queue: 100}"
    file.write_text(f"/**:\n  ros__parameters: {shared}\n")
    arguments = ["--ros-args", "--params-file", str(file)]
    assert Started(domain, tmp_path, "recorder", *arguments).comes_up()
    log = (tmp_path / "recorder.log").read_text()
    names = "arm.length, joints, pathh (did you mean 'path'?)"
    warning = f"parameter {names}: ignored; it is in a section for all nodes, and"
    assert log.count(warning) == log.count("ignored") == 1, log
    again = Started(domain, tmp_path, "recorder", *arguments, "-p", "joints:=6").refusal()
    assert "parameter joints: /recorder has none of that name" in again


def test_a_drive_makes_the_time(domain: int, tmp_path: Path) -> None:
    arguments = ["--ros-args", "-p", "use_sim_time:=true"]
    assert Started(domain, tmp_path, "drive_sim", *arguments).comes_up()
    log = (tmp_path / "drive_sim.log").read_text()
    assert "use_sim_time = True: has no effect, because this node is the source of simulated" in log


def test_a_slip_in_a_file_is_found_in_a_namespace_too(domain: int, tmp_path: Path) -> None:
    file = tmp_path / "slip.yaml"
    file.write_text("/left/recorder:\n  ros__parameters: {qeue: 10}\n")
    arguments = ["--ros-args", "--params-file", str(file), "-r"]
    refused = Started(domain, tmp_path, "recorder", *arguments, "__ns:=/left").refusal()
    assert "parameter qeue: /left/recorder has none of that name; did you mean 'queue'?" in refused
    other = Started(domain, tmp_path, "recorder", *arguments, "__ns:=/right")
    assert other.comes_up(), "not its own"


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
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "full.rrd").symlink_to("/dev/full")
    (folder / "hold.png").write_text("a picture")
    before, path = sorted(folder.iterdir()), folder / name
    refused = Started(domain, tmp_path, "recorder", "--ros-args", "-p", f"path:={path}").refusal()
    assert f"parameter path = {path}: {words}" in refused
    assert sorted(folder.iterdir()) == before

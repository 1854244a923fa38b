"""What lies outside of the program: standard output, names of files, a missing ROS 2."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = (sys.executable, "-m", "ab_sim")


def refused(*command: str | bytes, **options: object) -> str:
    """Run a command that is refused: one line, no traceback."""
    done = subprocess.run(command, stderr=subprocess.PIPE, check=False, **options)  # type: ignore[call-overload]
    said = done.stderr.decode()
    assert done.returncode == 2 and "Traceback" not in said, said
    return str(said)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (("scenes",), "cannot write standard output"),
        (("run", "no-ball", "--json", "-"), "--json -: cannot be written"),
        (("effects",), "cannot write standard output"),
    ],
)
def test_standard_output_on_a_full_disk(arguments: tuple[str, ...], name: str) -> None:
    with open("/dev/full", "wb") as full:
        said = refused(*TOOL, *arguments, stdout=full)
    assert f"ab-sim: {name}: No space left on device" in said


@pytest.mark.parametrize("option", ["--json", "--plot", "--rrd"])
def test_names_that_are_too_long_or_no_text(option: str, tmp_path: Path) -> None:
    ending = {"--json": ".json", "--plot": ".png", "--rrd": ".rrd"}[option]
    long = tmp_path / ("a" * 300 + ending)
    said = refused(*TOOL, "run", "no-ball", option, str(long), stdout=subprocess.DEVNULL)
    assert "has a name of 30" in said and "must be at most 255" in said
    name = os.fsencode(tmp_path) + b"/\xff\xfe" + ending.encode()
    said = refused(*TOOL, "run", "no-ball", option, name, stdout=subprocess.DEVNULL)
    assert "is not UTF-8; choose another name" in said


@pytest.mark.parametrize("node", ["drive_sim", "profile_controller", "recorder"])
def test_a_node_without_ros(node: str) -> None:
    """As on a machine without ROS 2: its packages are hidden."""
    hide = (
        "import importlib.util, runpy, sys; find = importlib.util.find_spec; "
        "importlib.util.find_spec = lambda name, *more: None if name == 'rclpy' else "
        "find(name, *more); sys.argv = ['-m']; "
        f"runpy.run_module('ab_sim.nodes.{node}', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", hide], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert done.stderr.startswith("ROS 2 is needed to run a node, and there is no rclpy; install")

"""The firmware prototypes as processes on a real drive: Python over ROS, and C without any ROS."""

import math
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import WhirlSample, topics
from ab_sim.control import chosen
from ab_sim.scene import load_scene
from tests.examples.prototype import FOLDER
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros

LANGUAGES = ("python", "c")


@pytest.fixture(scope="module")
def binary(tmp_path_factory: pytest.TempPathFactory) -> Path:
    assert shutil.which("idlc"), "run tools/install-cyclonedds"
    build = tmp_path_factory.mktemp("build")
    flags = "CFLAGS=-O2 -Wall -Wextra -Werror"
    made = subprocess.run(
        ["make", "-C", FOLDER / "c", f"BUILD={build}", flags], capture_output=True, text=True
    )
    assert made.returncode == 0, made.stdout + made.stderr
    seen = subprocess.run(["nm", "-D", build / "firmware"], capture_output=True, text=True)
    assert " T ddsi_tl_handle_reply" in seen.stdout, "the library calls its own, which crashes"
    return build / "firmware"


def said_by_itself(fleet: Fleet) -> list[str]:
    """Lines of the firmware's log. Fast DDS adds coloured ones, as where a peer was killed."""
    return [line for line in fleet.log("firmware").splitlines() if "\x1b" not in line]


def start(fleet: Fleet, language: str, binary: Path, namespace: str = "") -> None:
    python = [sys.executable, FOLDER / "firmware.py", "--ros-args", "-r", f"__ns:=/{namespace}"]
    fleet.start_process("firmware", *(python if language == "python" else [binary, namespace]))


def whirl_over_eccentricity(messages: list[Any]) -> float:
    whirl = [math.hypot(*WhirlSample.of(message).place) for message in messages]
    return float(np.mean(whirl)) / load_scene("balanced-start-up").rotor.eccentricity


@pytest.mark.parametrize("language", LANGUAGES)
def test_it_balances_and_runs_down_on_ctrl_c(fleet: Fleet, language: str, binary: Path) -> None:
    """Without the hold 0.8 e are left; see ``test_start_up``."""
    whirl, joints = fleet.listen(topics.WHIRL), fleet.listen(topics.JOINT_STATES)
    start(fleet, language, binary)
    fleet.start("drive_sim", scene="balanced-start-up")
    fleet.until(lambda: "balanced to" in fleet.log("firmware"), "it is through")
    # Another one takes over, whose drive is quiet from the beginning.
    first = said_by_itself(fleet)
    assert fleet.stop("firmware", signal.SIGKILL) == -signal.SIGKILL
    start(fleet, language, binary)
    fleet.until(lambda: "balanced to" in fleet.log("firmware"), "it is through, too")
    heard = len(whirl)
    fleet.until(lambda: len(whirl) > heard + 250, "a second of whirl")
    assert whirl_over_eccentricity(whirl[heard:]) < 0.3
    assert joints[-1].velocity[0] == 200.0
    assert fleet.stop("firmware") == 0
    fleet.until(lambda: joints[-1].velocity[0] == 0.0, "the spindle stands still")
    said = said_by_itself(fleet)
    assert [line.partition(":")[0] for line in said] == [
        "waiting", "run up", "hold", "to final", "at speed", said[5], "run down", "off",
    ]  # fmt: skip
    for lines in (first, said):
        (left,) = [line for line in lines if line.startswith("to final: ")]
        assert left.endswith(" m/s^2, quiet"), f"its end was waited for, not measured: {lines}"
    assert fleet.value("drive_sim", "commands rejected") == "0"
    assert fleet.stop("drive_sim") == 0


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_reset_of_the_drive_ends_it(fleet: Fleet, language: str, binary: Path) -> None:
    """In a namespace, too; nothing turns afterwards, and the exit code tells."""
    joints = fleet.listen(topics.JOINT_STATES._replace(name="left/joint_states"))
    start(fleet, language, binary, "left")
    fleet.start("left/drive_sim", scene="balanced-start-up")
    fleet.until(lambda: joints and joints[-1].velocity[0] > 20.0, "it runs up")
    process = fleet.processes.pop("firmware")
    assert fleet.call("left/drive_sim/reset")[0]
    fleet.until(lambda: process.poll() is not None, "the firmware ends")
    assert process.returncode == 1
    assert "run down: failure: the drive's time went back" in fleet.log("firmware")
    fleet.until(lambda: joints[-1].velocity[0] == 0.0, "the spindle stands still")


@pytest.mark.parametrize("language", LANGUAGES)
def test_ctrl_c_without_a_drive(fleet: Fleet, language: str, binary: Path) -> None:
    start(fleet, language, binary)
    fleet.until(lambda: "waiting: for a drive" in fleet.log("firmware"), "it waits")
    assert fleet.stop("firmware") == 0
    assert said_by_itself(fleet)[-1] == "off: never started"


def test_bad_options_get_one_line(fleet: Fleet, binary: Path) -> None:
    for command, words in (
        ([sys.executable, FOLDER / "firmware.py", "--ramp", "nan"], "nan: must be a finite number"),
        ([binary, "--help"], "usage: firmware [--adaptive] [NAMESPACE]"),
    ):
        fleet.start_process("firmware", *command)
        assert fleet.ended("firmware") == 2
        assert words in fleet.log("firmware")


def test_the_adaptive_start_up_in_c_finds_its_own_way(fleet: Fleet, binary: Path) -> None:
    """Told nothing but the final speed, over what the drive publishes, which comes later."""
    whirl = fleet.listen(topics.WHIRL)
    fleet.start_process("firmware", binary, "--adaptive")
    late = time.monotonic() + 1.2 * chosen.FIRST_SAMPLES
    fleet.until(lambda: time.monotonic() > late, "a controller would give up by now")
    fleet.start("drive_sim", scene="balanced-start-up")
    fleet.until(lambda: "done: critical speed" in fleet.log("firmware"), "it is through")
    # When it begins to dwell it knows 100 rad/s to some 2 rad/s only.
    assert re.search(r"done: critical speed (9[89]|10[01])\.", fleet.log("firmware"))
    heard = len(whirl)
    # The firmware knows the balls' share by now; a free whirl of several e dies away at 1/s.
    fleet.until(lambda: len(whirl) > heard + 1000, "four seconds of whirl")
    # Without the hold 0.8 e are left.
    assert whirl_over_eccentricity(whirl[heard + 950 : heard + 1000]) < 0.5, fleet.log("firmware")
    assert fleet.stop("firmware", signal.SIGINT) == 0
    assert "aborted: " in fleet.log("firmware")

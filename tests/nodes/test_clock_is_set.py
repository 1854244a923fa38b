"""The system clock is set while nodes run; they keep to the steady clock.

A library stands in for the system's clock, for one process: to set the machine's is not ours.
"""

import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from ab_msgs_py import topics
from tests.nodes.fleet import Fleet

pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler, cc"),
]
DAY = 86_400.0


class SystemClock:
    """A clock that is ahead of the machine's by some time.

    Parameters
    ----------
    folder
        For its library and its file.
    """

    def __init__(self, folder: Path) -> None:
        self._file, library = folder / "ahead", folder / "set_clock.so"
        self.set(0.0)
        source = Path(__file__).with_name("set_clock.c")
        words = ["cc", "-O1", "-Wall", "-Werror", "-shared", "-fPIC", source, "-o", library, "-ldl"]
        subprocess.run(words, check=True)
        self.environment = [f"LD_PRELOAD={library}", f"SET_CLOCK={self._file}"]

    def set(self, ahead: float) -> None:
        """Set the clock to so much ahead of the machine's [s]."""
        with self._file.open("r+b" if self._file.exists() else "wb") as file:
            file.write(struct.pack("q", round(ahead * 1e9)))


@pytest.fixture
def clock(tmp_path: Path) -> SystemClock:
    return SystemClock(tmp_path)


def start(fleet: Fleet, clock: SystemClock, node: str, **parameters: object) -> None:
    """Start a node that has this clock."""
    settings = [part for k, v in parameters.items() for part in ("-p", f"{k}:={v}")]
    module = [sys.executable, "-m", f"ab_sim.nodes.{node}", "--ros-args", *settings]
    fleet.start_process(node, "env", *clock.environment, *module)


@pytest.mark.parametrize("step", [-DAY, DAY])
def test_a_profile_goes_on(fleet: Fleet, clock: SystemClock, step: float) -> None:
    commands = fleet.listen(topics.COMMAND)
    fleet.start("drive_sim", scene="thesis-hold")
    start(fleet, clock, "profile_controller", profile="thesis-hold", auto_start=True)
    fleet.until(lambda: len(commands) > 200, "it commands")
    # Set right again, too: while the clock is behind, threads of Fast DDS 3.2 wait for shared
    # memory until a time of this clock. Its watchdog then takes them for dead, and of a node that
    # exits one thread replaces a port while another one closes it: a segmentation fault (2 of 12).
    for ahead in (step, 0.0):
        clock.set(ahead)
        heard = len(commands)
        fleet.until(lambda heard=heard: len(commands) > heard + 400, "it goes on")
    speeds = [topics.COMMAND.sample(message) for message in commands]
    rise = max(after - before for before, after in zip(speeds, speeds[1:], strict=False))
    assert rise < 50.0, "no jump"
    assert fleet.value("profile_controller", "ticks lost")
    for node in ("profile_controller", "drive_sim"):
        assert fleet.stop(node) == 0


def test_delays_of_commands(fleet: Fleet, clock: SystemClock) -> None:
    """The clock is set while commands wait for the next of few wake-ups."""
    start(
        fleet, clock, "drive_sim", scene="thesis-hold", wake_rate=1.0, block_rate=1.0, patience=5.0
    )
    fleet.until(lambda: fleet.value("drive_sim", "speed set by"), "it is up")
    for days in range(1, 6):
        before = fleet.value("drive_sim", "commands accepted")
        fleet.command(float(days))
        fleet.acquainted()
        clock.set(days * DAY)
        fleet.until(
            lambda before=before: fleet.value("drive_sim", "commands accepted") != before, "heard"
        )
    assert float(fleet.value("drive_sim", "command to output, worst [s]") or 0.0) < 0.1 * DAY
    assert fleet.stop("drive_sim") == 0

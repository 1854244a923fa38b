"""`ab-sim live` and `ab-sim view`, whole: real nodes, a real viewer, an orderly end."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from ab_sim.recording import read_recording
from tests.cli.tool import ab_sim
from tests.recording.runs import record, run

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def own(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test on a domain of its own."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))


class Command:
    """`ab-sim` in a process whose output is read as it comes."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "ab_sim", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=ROOT,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        self.said = ""

    def until(self, words: str) -> str:
        """Read until a line has these words; that line."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said += line
            if words in line:
                return line
        raise AssertionError(f"it ended without {words!r}: {self.said}")

    def end(self) -> int:
        """Ctrl-C; the exit code."""
        self.process.send_signal(signal.SIGINT)
        rest, _ = self.process.communicate(timeout=60.0)
        self.said += rest
        return self.process.returncode


@pytest.fixture
def commands() -> Iterator[list[Command]]:
    made: list[Command] = []
    yield made
    for command in made:
        command.process.kill()
        command.process.communicate()


@pytest.mark.ros
def test_a_changed_scene_for_a_while(commands: list[Command], tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    file = tmp_path / "run.rrd"
    arguments = ["live", "thesis-hold", "--record", str(file), "--set", "balls.mass=0.002"]
    live = Command(*arguments, "--set", "profile.target_speed=150.0", "--for", "0.5")
    commands.append(live)
    live.until("real-time factor")
    assert live.process.wait(60.0) == 0
    recorded = read_recording(file)
    assert recorded.complete and recorded.missing == 0
    assert recorded.description["scene"]["balls"]["mass"] == 0.002
    assert recorded["time"][-1] >= 0.5 and recorded["command"].max() > 5.0


@pytest.mark.ros
def test_watched_without_a_file_until_interrupted(commands: list[Command]) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    live = Command("live", "thesis-hold", "--view", "web", "--for", "3600")
    commands.append(live)
    assert "http://127.0.0.1:" in live.until("watch it at")
    for _ in range(3):  # a line each second from the start on
        live.until(" of 3600 s")
    assert live.end() == 0
    assert "real-time factor" in live.said and "wrote" not in live.said
    assert "Traceback" not in live.said and "interrupted" not in live.said


def test_view_until_interrupted(commands: list[Command], tmp_path: Path) -> None:
    file = tmp_path / "run.rrd"
    record(file, *run(100))
    view = Command("view", str(file), "--web")
    commands.append(view)
    assert "http://127.0.0.1:" in view.until("watch at")
    assert view.end() == 0
    assert "Traceback" not in view.said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("view", "nowhere.rrd", "--web"), "nowhere.rrd: no such file"),
        (("view", "README.md"), "must end in .rrd"),
        (("live", "thesis-hold", "--view", "screen"), "--view 'screen': must be web, native"),
        (("live", "thesis-hold", "--for", "0"), "--for 0: must be above 0 s"),
        (("live", "thesis-hold", "--for", "nan"), "--for nan: must be above 0 s"),
        (("live", "thesis-hold", "--record", "run.bag"), "must end in .rrd"),
        (("live", "thesis-hold", "--set", "balls.mas=1"), "did you mean"),
        (("demo", "--view", "rerun+http://x/proxy"), "is not the address of a viewer"),
    ],
)
def test_bad_input(arguments: tuple[str, ...], words: str) -> None:
    done = ab_sim(*arguments)
    assert done.returncode == 2
    assert words in done.stderr and "Traceback" not in done.stderr


def test_no_screen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    file = tmp_path / "run.rrd"
    record(file, *run(10))
    for arguments in (("view", str(file)), ("live", "thesis-hold", "--view", "native")):
        done = ab_sim(*arguments)
        assert done.returncode == 2 and "there is no screen" in done.stderr
        assert "web" in done.stderr

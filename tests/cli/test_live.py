"""`ab-sim live` and `ab-sim view`, whole: real nodes, a real viewer, an orderly end."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.request import urlopen

import pytest

from tests.cli.tool import ab_sim, refused
from tests.recorded import read_recording
from tests.recording.runs import record, run

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def own(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test on a domain of its own."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))


class Command:
    """`ab-sim` in a process whose output is read as it comes."""

    def __init__(self, *arguments: str, cwd: Path = ROOT) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "ab_sim", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=cwd,
            env={**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "500"},
        )
        self.said = ""

    def until(self, pattern: str) -> str:
        """Read until a line matches a pattern; return the line."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said += line
            if re.search(pattern, line):
                return line
        raise AssertionError(f"it ended without {pattern!r}: {self.said}")

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
def test_a_folder_of_that_name_in_the_working_directory_is_not_imported(tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    (tmp_path / "ab_sim").mkdir()
    (tmp_path / "ab_sim" / "__init__.py").write_text("raise SystemExit('the wrong ab_sim')\n")
    script = Path(sys.executable).with_name("ab-sim")
    live = [script, "live", "thesis-hold", "--for", "0.1"]
    done = subprocess.run(live, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.ros
def test_a_changed_scene_for_a_while(commands: list[Command], tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    file = tmp_path / "run.rrd"
    arguments = ["live", "thesis-hold", "--record", str(file), "--set", "balls.mass=0.002"]
    live = Command(*arguments, "--set", "profile.target_speed=150.0", "--for", "0.5")
    commands.append(live)
    live.until("real-time factor")
    assert live.process.wait(60.0) == 0
    assert "equal balls that start at one angle never part" in live.said.partition("starting")[0]
    recorded = read_recording(file)
    assert recorded.complete and recorded.missing == 0
    assert recorded.description["scene"]["balls"]["mass"] == 0.002
    assert recorded["time"][-1] >= 0.5 and recorded["command"].max() > 5.0


@pytest.mark.ros
def test_recorded_unasked_and_served_after_the_end(commands: list[Command], tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    live = Command("live", "thesis-hold", "--view", "web", "--for", "0.5", cwd=tmp_path)
    commands.append(live)
    address = live.until("watch it at").split()[-1]
    live.until("starts when the page is open, or with Enter")
    assert live.process.stdin is not None
    live.process.stdin.write("\n")
    live.process.stdin.flush()
    hint = live.until("wrote recordings")
    live.until("the run is over")
    with urlopen(address) as page:
        assert b"Rerun" in page.read()
    words = re.search(r"look at it: (.*) view (\S+) --web", hint)
    assert words is not None and shutil.which(words[1])
    assert live.end() == 0 and "Traceback" not in live.said
    recorded = read_recording(tmp_path / words[2])
    assert recorded.complete and recorded.missing == 0 and recorded["time"][-1] >= 0.5


@pytest.mark.ros
def test_unwatched_and_started_again_after_a_reset(commands: list[Command], tmp_path: Path) -> None:
    """It starts again, counts again after another reset, and ends in order."""
    pytest.importorskip("rclpy", reason="needs ROS 2")
    nobody = "rerun+http://127.0.0.1:9/proxy"
    assert ab_sim("--version").returncode == 0  # takes seconds once, which the run need not last
    live = Command("live", "balanced-start-up", "--for", "3600", "--view", nobody, cwd=tmp_path)
    commands.append(live)

    def count() -> float:
        return float(live.until(r"^ *[\d.]+ of 3600 s").split()[0])

    assert live.until("cannot be watched") == f"cannot be watched: there is no viewer at {nobody}\n"
    live.until("running: segment")
    for word in ("reset", "pause"):
        done = ab_sim("node", word, "--wait", "60")
        assert done.returncode == 0, done.stderr
    time = 1e-9 * json.loads(ab_sim("node", "step", "--wait", "60").stdout)["sim_time_ns"]
    started = ab_sim("node", "start", "--wait", "60").stdout
    assert started == f"started at t = {time + 0.1:g} s\n", "so that it arrives in time"
    assert ab_sim("node", "resume", "--wait", "60").returncode == 0
    live.until("aborted: time jumped")
    live.until("running: segment|done")  # a busy machine may skip a segment
    done = ab_sim("node", "reset", "--wait", "60")
    assert done.returncode == 0, done.stderr
    last = count()
    while (now := count()) >= last:  # a line each second
        last = now
    assert count() > now
    assert live.end() == 0
    assert "commands rejected 0" in live.said and "wrote recordings" in live.said
    factor = re.search(r"real-time factor ([0-9.]+)", live.said)
    assert factor is not None and float(factor[1]) > 0.5, "not 2 s of 5 s"
    assert "Traceback" not in live.said and "interrupted" not in live.said


@pytest.mark.ros
def test_interrupted_before_anybody_watches(commands: list[Command], tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    live = Command("live", "thesis-hold", "--view", "web", cwd=tmp_path)
    commands.append(live)
    live.until("starts when the page is open")
    children = Path(f"/proc/{live.process.pid}/task/{live.process.pid}/children")
    nodes = [Path("/proc", child) for child in children.read_text(encoding="utf-8").split()]
    assert len(nodes) == 3
    assert live.end() == 130
    assert live.said.endswith("ab-sim: interrupted\n") and "Traceback" not in live.said
    assert not any(node.exists() for node in nodes)
    assert not any(tmp_path.rglob("*.rrd")), "there was no run"


def test_view_until_interrupted(commands: list[Command], tmp_path: Path) -> None:
    file = tmp_path / "run.rrd"
    record(file, *run(100))
    view = Command("view", str(file), "--web")
    commands.append(view)
    address = view.until("watch at http://127.0.0.1:").split()[2]
    with urlopen(address) as page:  # at once
        assert page.status == 200
    assert view.end() == 0
    assert "Traceback" not in view.said


def test_view_at_a_port_that_is_taken(tmp_path: Path) -> None:
    file = tmp_path / "run.rrd"
    record(file, *run(10))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        error = refused("view", str(file), "--web", "--port", port)
    assert "\n" not in error and f"port {port}: Address already in use" in error


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
    assert words in refused(*arguments)


def test_no_screen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    file = tmp_path / "run.rrd"
    record(file, *run(10))
    for arguments in (("view", str(file)), ("live", "thesis-hold", "--view", "native")):
        error = refused(*arguments)
        assert "there is no screen" in error and "web" in error

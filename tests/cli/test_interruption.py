"""Ctrl-C while a program imports, compiles, runs: it ends with one line and no traceback."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ab_sim.base import interruption
from tests.nodes import slow_to_compile

ROOT = Path(__file__).resolve().parents[2]
ENDS = 60.0
"""s; what it was doing would take longer on a machine so busy that this is not enough."""


class Program:
    """Python in a process of its own, whose output is read as it comes.

    Parameters
    ----------
    arguments
        Module to run, and what it is told.
    imports
        Also say which module has been imported, so that a test knows where it is.
    environment
        In addition to this process'.
    """

    def __init__(self, *arguments: str, imports: bool = False, **environment: str) -> None:
        saying = ["-X", "importtime"] if imports else []
        self.process = subprocess.Popen(
            [sys.executable, *saying, "-m", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=ROOT,
            start_new_session=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1", **environment},
        )
        self.said: list[str] = []

    def until(self, words: str) -> None:
        """Read until it says these words."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._note(line)
            if words in line:
                return
        raise AssertionError(f"it ended without {words!r}: {self.said}")

    def until_it_has_children(self, count: int) -> list[str]:
        """Wait until it has started so many processes; their numbers."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        while len(found := children.read_text(encoding="utf-8").split()) < count:
            assert self.process.poll() is None, self.process.communicate()
            with pytest.raises(subprocess.TimeoutExpired):
                self.process.wait(timeout=0.05)
        return found

    def interrupted(
        self, number: int = signal.SIGINT, its_children: bool = False
    ) -> tuple[int, str]:
        """Send a signal; exit code, and what it has said but for imports.

        Parameters
        ----------
        number
            Of the signal.
        its_children
            Get it as well, as when it comes from a terminal.
        """
        if its_children:
            os.killpg(self.process.pid, number)
        else:
            self.process.send_signal(number)
        assert self.process.stdout is not None
        # Not by `communicate`, which loses what `until` has read beyond its line.
        end = threading.Timer(ENDS, self.process.kill)
        end.start()
        for line in self.process.stdout:
            self._note(line)
        code = self.process.wait()
        end.cancel()
        return code, "".join(self.said)

    def _note(self, line: str) -> None:
        if not line.startswith("import time:"):
            self.said.append(line)


Start = Callable[..., Program]


@pytest.fixture
def start(tmp_path: Path, domain: int) -> Iterator[Start]:
    """Starts a program with an empty cache of results."""
    made: list[Program] = []

    def start(*arguments: str, imports: bool = False) -> Program:
        environment = {"XDG_CACHE_HOME": str(tmp_path), "ROS_DOMAIN_ID": str(domain)}
        made.append(Program(*arguments, imports=imports, **environment))
        return made[-1]

    yield start
    for program in made:
        program.process.kill()
        program.process.communicate()


RUN = ("ab_sim", "run", "thesis-hold")
COMPILES = " ab_sim.drive.steps\n"
"""The last that is imported before machine code is made."""
NODE = ("ab_sim.nodes.drive_sim", "--ros-args", "-p", "scene:=thesis-hold")


@pytest.mark.parametrize("module", ["typer", "numpy", "llvmlite.binding", "rich.progress"])
def test_while_the_command_line_imports(start: Start, module: str) -> None:
    program = start(*RUN, imports=True)
    program.until(f" {module}\n")
    assert program.interrupted() == (130, "interrupted\n")


@pytest.mark.ros
@pytest.mark.parametrize("module", ["rclpy.node", "llvmlite.binding"])
def test_while_a_node_imports(start: Start, module: str) -> None:
    program = start(*NODE, imports=True)
    program.until(f" {module}\n")
    assert program.interrupted() == (130, "interrupted\n")


def test_while_it_compiles(start: Start) -> None:
    program = start(*RUN, imports=True)
    program.until(COMPILES)
    assert program.interrupted() == (130, "interrupted\n")


def test_a_paper_that_is_interrupted_leaves_no_folder(start: Start, tmp_path: Path) -> None:
    arguments = "ab_sim", "paper", "deck-3d", "--out", str(tmp_path / "made" / "papers")
    program = start(*arguments, imports=True)
    program.until(COMPILES)
    assert program.interrupted()[0] == 130
    assert not (tmp_path / "made").exists()


@pytest.mark.ros
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_while_a_node_compiles(start: Start, number: int) -> None:
    """Its loop is waiting for that, and ends in order."""
    program = start(slow_to_compile.MODULE, "1", *NODE[1:])
    program.until(slow_to_compile.COMPILES)
    code, said = program.interrupted(number)
    else_said = said.replace(slow_to_compile.COMPILES, "").splitlines()
    assert (code, [line for line in else_said if line and "[INFO]" not in line]) == (0, [])


@pytest.mark.ros
def test_a_signal_that_a_launch_forwards_counts_once(start: Start) -> None:
    """To a node's process from the terminal, and from the launch, while it ends in order."""
    program = start("ab_sim.nodes.profile_controller")
    program.until("waiting for ~/start")
    for _ in range(3):
        program.process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.process.wait(timeout=0.02)
    code, said = program.interrupted()
    assert code == 0 and "interrupted" not in said


@pytest.mark.ros
@pytest.mark.parametrize("after", [0.0, 0.005, 0.01, 0.02, 0.05])
def test_a_node_of_live_or_demo_at_its_first_instructions(start: Start, after: float) -> None:
    """They start it so that Ctrl-C waits until it knows how to end."""
    with interruption.kept_from_children():
        program = start("ab_sim.nodes.drive_sim")
    with contextlib.suppress(subprocess.TimeoutExpired):
        program.process.wait(timeout=after)
    assert program.interrupted() == (130, "interrupted\n")


WAITS = """
import threading
from ab_sim.base import interruption
interruption.watch()
with interruption.in_order() as stopping:
    print("waiting", flush=True)
    stopping.wait()
    print("told", flush=True)
{then}threading.Event().wait()
"""


@pytest.mark.parametrize("then", ["    ", ""], ids=["in order", "behind it"])
def test_a_second_wish_ends_it_at_once(then: str) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", WAITS.format(then=then)], stdout=subprocess.PIPE, text=True, cwd=ROOT
    )
    try:
        assert process.stdout is not None and process.stdout.readline() == "waiting\n"
        began, sent = time.monotonic(), 0
        while process.poll() is None:
            assert time.monotonic() < began + ENDS
            process.send_signal(signal.SIGTERM)
            sent += 1
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(timeout=0.05)
        assert process.returncode == 143 and sent > 2
        assert time.monotonic() - began > interruption.ONE_WISH, "until then they are the first one"
    finally:
        process.kill()
        process.communicate()


def test_terminated(start: Start) -> None:
    program = start(*RUN, imports=True)
    program.until(" llvmlite.binding\n")
    assert program.interrupted(signal.SIGTERM) == (143, "interrupted\n")


@pytest.mark.ros
def test_the_demo_ends_its_nodes(start: Start, tmp_path: Path) -> None:
    """While they start: the worst time, for each of them is busy with something else."""
    program = start("ab_sim", "demo", "--out", str(tmp_path / "out"))
    nodes = program.until_it_has_children(3)
    code, said = program.interrupted()
    assert code == 130
    assert said.count("interrupted") == 1 and "Traceback" not in said
    assert not [node for node in nodes if Path(f"/proc/{node}").exists()]
    for log in (tmp_path / "out" / "log").iterdir():
        assert "Traceback" not in log.read_text()


HASTY = """
import os, signal, sys
from ab_sim.base import interruption
interruption.watch()
from ab_sim.cli.progress import interruptible
from ab_sim.base.errors import AbSimError, Interrupted
sys.setswitchinterval(10.0)  # the thread that heeds signals waits for this one
try:
    with interruptible("work", "all is kept"):
        os.kill(os.getpid(), signal.SIGTERM)
        raise AbSimError("a worker is gone")
except Interrupted as interrupted:
    print(interrupted)
"""


def test_what_a_signal_makes_fail_is_no_failure() -> None:
    """It reaches other processes too, whose end may be seen before the signal is."""
    done = subprocess.run([sys.executable, "-c", HASTY], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout) == (0, "interrupted; all is kept\n"), done.stderr

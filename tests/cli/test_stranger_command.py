"""A command of a stranger's own: all of it is in this file, and no file of the package knows it."""

import functools
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from rich.table import Table
from typer.testing import CliRunner

from ab_sim import cli
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.cli import progress
from ab_sim.cli.app import app
from ab_sim.cli.declare import Changes, Heading, Json, Plot, SceneName
from ab_sim.cli.runner import Command, Outcome
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene import load_scene
from tests.cli.test_interruption import ROOT, Program
from tests.cli.tool import PNG

MODULE = "tests.cli.test_stranger_command"
LEFT = "nothing was written"
stranger_commands = Heading("Of a stranger")
begun: list[str] = []
"""Scenes that it has begun to work on."""


@stranger_commands.declare(f"{MODULE}:turns_command")
class TurnsOptions(NamedTuple):
    """How far a scene's profile turns the spindle.

    Parameters
    ----------
    count N
        Instants over the scene's duration.
    plot
        Draw them.
    """

    scene: SceneName
    change: Changes = []
    count: int = 1
    json: Json = None
    plot: Plot = None


def turns_command(given: TurnsOptions) -> Command:
    count = given.count
    if count < 1:
        raise InputError(f"--count {count}: must be at least 1")
    scene = load_scene(given.scene, given.change)

    def work(tell: Progress) -> Outcome:
        begun.append(scene.name)
        schedule, found = SpeedSchedule.of_scene(scene), []
        for k in range(count):
            tell("instants", k, count)
            time = (k + 1) / count * scene.duration
            found.append((time, schedule.angle(time) / (2.0 * math.pi)))
        table = Table("time [s]", "turns of the spindle", title=scene.name)
        for row in found:
            table.add_row(*(f"{value:.6g}" for value in row))
        draw = functools.partial(figure, found)
        return Outcome([table, "by its profile"], lambda: {"turns": found}, draw)

    return Command(work, scene.name, LEFT)


def figure(found: list[tuple[float, float]], file: Path) -> None:
    """Import matplotlib only where a picture is drawn."""
    from matplotlib.figure import Figure

    from ab_sim.show.saved import save

    drawn = Figure()
    drawn.subplots().plot(*zip(*found, strict=True))
    save(drawn, file, 50)


def test_files_are_written_independently(tmp_path: Path) -> None:
    """A file that cannot be written leaves the others; null for a number has its reason."""
    page, report, rows = tmp_path / "page", tmp_path / "run.json", list[str]()

    def refuse(file: Path) -> None:
        raise OSError(28, "the disk is full")

    def write(file: Path) -> None:
        file.write_text("whole", encoding="utf-8")

    def shown() -> Iterator[str]:
        rows.append("shown")
        yield "shown"

    outcome = Outcome(
        shown(),
        lambda: {"z": math.inf, "tried": [{"z": -math.inf}], "low": (math.nan, 1.0)},
        writes={"--out": refuse, "--html": write},
    )
    outputs = (tmp_path / "out.yaml", (".yaml",), "--out"), (page, ("",), "--html")
    with pytest.raises(InputError, match=r"--out .*out.yaml: .*disk is full"):
        Command(lambda _: outcome, outputs=outputs).run(str(report))
    assert page.read_text() == "whole" and rows == ["shown"]
    assert json.loads(report.read_text()) == {
        **{"z": None, "tried": [{"z": None}], "low": [None, 1.0]},
        "not_finite": {"z": "infinite", "tried.0.z": "minus infinite", "low.0": "not a number"},
    }


@pytest.fixture
def added() -> Iterator[None]:
    """Known while a test runs."""
    assert "turns" not in CliRunner().invoke(app, ["--help"]).output
    app.add_typer(stranger_commands)
    begun.clear()
    yield
    app.registered_groups.pop()


def ab_sim(*arguments: str, cwd: Path) -> Any:
    """In a process of its own, with this command."""
    return subprocess.run(
        [sys.executable, "-m", MODULE, *arguments],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=cwd, capture_output=True, text=True,
    )  # fmt: skip


TURNS = "turns", "thesis-hold", "--set", "duration=2.5"
"""At 40 rad/s^2 from rest."""


def test_it_prints_a_table_and_writes_json_and_picture(tmp_path: Path) -> None:
    done = ab_sim(*TURNS, "--count", "2", "--json", "t.json", "--plot", "t.png", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "t.json").read_text())["turns"]
    assert found == [[t, pytest.approx(20.0 * t**2 / (2.0 * math.pi))] for t in (1.25, 2.5)]
    for words in ("thesis-hold", "turns of the spindle", f"{found[1][1]:.6g}", "by its profile"):
        assert words in done.stdout
    assert (tmp_path / "t.png").read_bytes().startswith(PNG)
    assert done.stderr.splitlines() == ["wrote t.json", "wrote t.png"]


def test_json_to_standard_output_is_only_json(tmp_path: Path) -> None:
    done = ab_sim(*TURNS, "--json", "-", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["turns"]) == 1
    assert "by its profile" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--plot", "t.bmp"), "--plot t.bmp: must end in one of .png"),
        (("--json", "t.png"), "--json t.png: must end in .json"),
        (("--json", "no/t.json", "--plot", "t.png"), "there is no folder no"),
    ],
)
def test_outputs_are_tried_before_any_work(
    arguments: tuple[str, ...],
    words: str,
    added: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    refused = CliRunner().invoke(app, [*TURNS, *arguments])
    assert isinstance(refused.exception, InputError) and words in str(refused.exception)
    assert begun == [] and list(tmp_path.iterdir()) == []
    done = CliRunner().invoke(app, [*TURNS, "--json", "t.json"])
    assert done.exit_code == 0 and begun == ["thesis-hold"]
    assert [path.name for path in tmp_path.iterdir()] == ["t.json"]


def test_bad_input_is_one_line_and_its_exit_code(tmp_path: Path) -> None:
    done = ab_sim(*TURNS, "--count", "0", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "ab-sim: --count 0: must be at least 1\n")


def test_progress_is_told_and_ctrl_c_ends_the_work_in_order(tmp_path: Path) -> None:
    files = "--json", str(tmp_path / "t.json"), "--plot", str(tmp_path / "t.png")
    program = Program(MODULE, *TURNS, "--count", str(10**9), *files)
    program.until("thesis-hold: instants, ")
    code, said = program.interrupted()
    assert (code, said.splitlines()[-1]) == (130, f"ab-sim: interrupted; {LEFT}")
    assert "Traceback" not in said and list(tmp_path.iterdir()) == []


if __name__ == "__main__":
    app.add_typer(stranger_commands)
    progress.EVERY = 0.1  # not to be waited for
    cli.main()

"""Commands that hints name work as they stand, in the folder and with the PATH of the user."""

import os
import shlex
import sys
from pathlib import Path

import pytest

from ab_sim.cli.outputs import own_command
from tests.cli.tool import ab_sim

SCRIPTS = Path(sys.executable).parent


def test_a_hint_is_a_command_that_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = os.pathsep.join(
        folder for folder in os.environ["PATH"].split(os.pathsep) if Path(folder) != SCRIPTS
    )
    monkeypatch.setenv("PATH", path)
    done = ab_sim("scenes", "no-ball", cwd=tmp_path)
    hint = done.stdout.splitlines()[-1].removeprefix("for a summary of the simulation: ")
    command, *arguments = shlex.split(hint)
    assert arguments == ["check", "no-ball"]
    assert Path(command).samefile(SCRIPTS / "ab-sim") and os.access(command, os.X_OK)


def test_the_shortest_name_that_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(SCRIPTS.parent)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert own_command() == str(Path(SCRIPTS.name, "ab-sim"))
    monkeypatch.setenv("PATH", str(SCRIPTS))
    assert own_command() == "ab-sim"
    elsewhere = tmp_path / "ab-sim"
    elsewhere.write_text("#!/bin/sh\n")
    elsewhere.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert own_command() != "ab-sim", "another installation's command"
    monkeypatch.setattr(sys, "executable", "/nowhere/python3")
    monkeypatch.setenv("PATH", "/nowhere")
    assert own_command() == "/nowhere/python3 -m ab_sim"

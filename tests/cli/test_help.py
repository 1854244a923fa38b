"""What the help says arrives as it was written."""

import importlib
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest
from typer.main import get_command
from typer.models import ArgumentInfo
from typer.testing import CliRunner

from ab_sim.cli.app import HEADINGS, app

CONTENTS = {
    "Run and watch": "demo run live view",
    "Write a scene": "scenes check keys effects sensors metrics schema",
    "Choose a design": "size sweep tune robust sensitivity",
    "Stability and vibration": "modes equilibria stability floquet recovery paper",
    "Accuracy and what it costs": "accuracy cost",
    "Recordings and measurements": "report compare identify export state",
    "ROS nodes and bags": "node import replay repair urdf",
    "Other tools": "c",
}
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]


def told(name: str) -> list[str]:
    """All texts of a command's help."""
    command = COMMANDS[name]
    return [command.help, *(getattr(parameter, "help", None) or "" for parameter in command.params)]


def installed(environment: dict[str, str], *arguments: str) -> str:
    """What the installed command prints."""
    command = [Path(sys.executable).with_name("ab-sim"), *arguments]
    return subprocess.run(
        command, env=dict(os.environ) | environment, capture_output=True, text=True, check=True
    ).stdout


def bracketed(text: str) -> list[str]:
    return re.findall(r"\[[^]]+\]", text)


def test_lists_of_arguments_have_no_default() -> None:
    """Click 8.1, which setup.py allows, takes none."""
    seen = 0
    commands = COMMANDS | COMMANDS["node"].commands
    for command in (command for name, command in commands.items() if name != "node"):
        for parameter in inspect.signature(command.callback).parameters.values():
            kind, *info = get_args(parameter.annotation)
            if info and isinstance(info[0], ArgumentInfo) and "list" in str(kind):
                assert parameter.default in (None, parameter.empty), f"{command.name}: {parameter}"
                seen += 1
    assert seen >= 7


def test_there_are_units_to_look_for() -> None:
    found = {unit for name in COMMANDS for text in told(name) for unit in bracketed(text)}
    assert {"[s]", "[rad]", "[e]", "[peers]"} <= found


def help_of(name: str, columns: int) -> str:
    """Return the help of a command on a terminal of this width."""
    return CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": str(columns)}).output


@pytest.mark.parametrize("name", COMMANDS)
def test_units_and_extras_in_brackets_arrive_and_nothing_is_cut_off(name: str) -> None:
    """Markup of terminals takes brackets for its own, and shows nothing."""
    shown = " ".join(help_of(name, 200).split())
    for text in told(name):
        for unit in bracketed(text):
            assert shown.count(unit) >= sum(other.count(unit) for other in told(name)), unit
    narrow = help_of(name, 80)
    assert max(map(len, narrow.splitlines())) <= 80 and "…" not in narrow


def test_every_command_has_one_line_under_one_heading() -> None:
    listed = [name for names in CONTENTS.values() for name in names.split()]
    assert sorted(listed) == sorted(COMMANDS)
    shown = installed({"COLUMNS": "80"}, "--help").splitlines()
    headings = re.findall(r"^╭─ (.+?) ─", "\n".join(shown), re.MULTILINE)
    assert headings == ["Options", *CONTENTS]
    for heading, names in CONTENTS.items():
        at = next(row for row, line in enumerate(shown) if line.startswith(f"╭─ {heading} ─"))
        rows = shown[at + 1 : at + 1 + len(names.split())]
        assert [row.split()[1] for row in rows] == names.split(), "in 80 columns, one line each"


def test_every_option_says_what_it_is_for() -> None:
    """And no word of the source is left in it."""
    of_nodes = {f"node {name}": each for name, each in COMMANDS["node"].commands.items()}
    silent = [
        f"{name} {parameter.name}"
        for name, command in (COMMANDS | of_nodes).items()
        for parameter in command.params
        if not getattr(parameter, "help", None) and not hasattr(command, "commands")
    ]
    assert silent == []
    assert not [name for name, command in COMMANDS.items() if "---" in command.help]


def test_the_work_of_every_command_is_there() -> None:
    """It is imported by its name, when the command is called."""
    for heading in HEADINGS:
        for work in heading.works:
            module, _, function = work.partition(":")
            assert callable(getattr(importlib.import_module(module), function))


def test_a_shell_completes_commands() -> None:
    asked = {"_AB_SIM_COMPLETE": "complete_bash", "COMP_WORDS": "ab-sim equ", "COMP_CWORD": "1"}
    assert installed(asked).split() == ["equilibria"]

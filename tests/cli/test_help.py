"""What the help says arrives as it was written."""

import re

import pytest
from typer.main import get_command

from ab_sim.cli.app import app
from tests.cli.tool import ab_sim

COMMANDS = get_command(app).commands  # type: ignore[attr-defined]


def told(name: str) -> list[str]:
    """All texts of a command's help."""
    command = COMMANDS[name]
    return [command.help, *(getattr(parameter, "help", None) or "" for parameter in command.params)]


def bracketed(text: str) -> list[str]:
    return re.findall(r"\[[^]]+\]", text)


def test_there_are_units_to_look_for() -> None:
    found = {unit for name in COMMANDS for text in told(name) for unit in bracketed(text)}
    assert {"[s]", "[rad]", "[e]", "[peers]"} <= found


@pytest.mark.parametrize("name", COMMANDS)
def test_units_and_extras_in_brackets_arrive(name: str) -> None:
    """Markup of terminals takes them for its own, and shows nothing."""
    shown = ab_sim(name, "--help").stdout
    for text in told(name):
        for unit in bracketed(text):
            assert shown.count(unit) >= sum(other.count(unit) for other in told(name)), unit

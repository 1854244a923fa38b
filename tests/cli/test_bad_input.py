"""What the measuring commands refuse, before they measure anything."""

import pytest

from tests.cli.tool import refused


@pytest.mark.parametrize("command", ["cost", "accuracy"])
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--repeats", "0"), "at least 1"),
        (("--plot", "x.txt"), "must end in one of"),
        (("--json", "no/folder/x.json"), "there is no folder"),
        (("--set", "solver.step=0.1"), "beyond the stability limit"),
    ],
)
def test_measuring_refuses_bad_input(command: str, arguments: tuple[str, ...], words: str) -> None:
    assert words in refused(command, "no-ball", *arguments)


def test_accuracy_needs_a_run_to_compare() -> None:
    assert "too short" in refused("accuracy", "no-ball", "--set", "duration=0.001")

"""What the measuring commands refuse, before they measure anything."""

import pytest

from tests.cli.tool import ab_sim


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
    done = ab_sim(command, "no-ball", *arguments)
    assert done.returncode == 2
    assert words in done.stderr and "Traceback" not in done.stderr


def test_accuracy_needs_a_run_to_compare() -> None:
    done = ab_sim("accuracy", "no-ball", "--set", "duration=0.001")
    assert done.returncode == 2
    assert "too short" in done.stderr and "Traceback" not in done.stderr

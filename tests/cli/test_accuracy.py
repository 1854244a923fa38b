"""`ab-sim accuracy` as a user runs it. Nothing here asserts a time."""

import json
from pathlib import Path

from ab_sim.analysis.accuracy_cost import REPEATS
from ab_sim.engine.integrate.registry import steppers
from tests.cli.tool import PNG, ab_sim


def test_accuracy_prints_a_table_and_writes_json_and_picture(tmp_path: Path) -> None:
    done = ab_sim("accuracy",
        "thesis-hold", "--set", "effects.rolling_friction=", "--set", "duration=0.05",
        "--repeats", "1", "--json", "-", "--plot", "a.png", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (report["scene"], report["balls"], report["repeats"]) == ("thesis-hold", 2, 1)
    methods = {row["method"] for row in report["rows"]}
    assert {*steppers(), "DOP853", "LSODA", "Radau", "CVODE Adams", "MuJoCo RK4"} <= methods
    for word in (
        *methods,
        "reference: Gauss",
        "it is independent",
        "uncertainty",
        "whirl [e]",
        "of a core",
        "peer / ab_sim",
    ):
        assert word in done.stderr
    assert (tmp_path / "a.png").read_bytes().startswith(PNG)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_help_tells_the_default_that_holds() -> None:
    assert f"default: {REPEATS}" in ab_sim("accuracy", "--help").stdout

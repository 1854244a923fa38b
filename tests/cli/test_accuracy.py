"""`ab-sim accuracy` as a user runs it. Nothing here asserts a time."""

import io
import json
import re
from pathlib import Path

from rich.console import Console

from ab_sim.analysis.accuracy_cost import REPEATS, accuracy_cost
from ab_sim.cli.costs import accuracy_table
from ab_sim.engine.integrate.registry import steppers
from ab_sim.scene import load_scene
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
        "ms/s",
        "peer / ab_sim",
    ):
        assert word in done.stderr
    assert "quartiles" not in done.stderr
    assert (tmp_path / "a.png").read_bytes().startswith(PNG)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_tables_fit_into_80_columns_and_quartiles_are_on_request() -> None:
    scene = load_scene("thesis-hold", ["effects.rolling_friction=", "duration=0.02"])
    cost = accuracy_cost(scene, 1, steps=(1e-3,), tolerances=())
    for quartiles, width in ((False, 80), (True, 100)):
        out = io.StringIO()
        console = Console(width=width, file=out)
        console.print(accuracy_table(cost, quartiles))
        text = out.getvalue()
        assert "…" not in text and ("quartiles" in text) == quartiles
        for row in cost.rows:
            assert re.search(rf"{row.method} +{row.setting} ", text), "in one line"


def test_help_tells_the_default_that_holds() -> None:
    assert f"default: {REPEATS}" in ab_sim("accuracy", "--help").stdout

"""`ab-sim cost` as a user runs it. Nothing here asserts a time."""

import json
from pathlib import Path

from ab_sim.scene import load_scene
from tests.cli.tool import PNG, ab_sim


def test_cost_prints_a_table_and_writes_json_and_picture(tmp_path: Path) -> None:
    done = ab_sim("cost",
        "no-ball", "--set", "duration=0.02", "--repeats", "2", "--json", "c.json",
        "--plot", "c.png", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "c.json").read_text())
    names = [row["name"] for row in report["rows"]]
    assert names == ["no effects", *load_scene("no-ball").effects, "the scene's set"]
    assert all(name in done.stdout for name in names)
    assert report["repeats"] == 2
    assert (tmp_path / "c.png").read_bytes().startswith(PNG)


def test_json_to_standard_output_is_only_json() -> None:
    done = ab_sim("cost", "no-ball", "--set", "duration=0.02", "--repeats", "1", "--json", "-")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["scene"] == "no-ball"
    assert "of base" in done.stderr

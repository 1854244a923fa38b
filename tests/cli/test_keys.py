"""`ab-sim keys` and `ab-sim schema`."""

import json
from pathlib import Path

from ab_sim.scene.keys import scene_keys
from ab_sim.scene.schema import scene_schema
from tests.cli.tool import ab_sim


def test_keys_are_listed_a_line_each() -> None:
    shown = ab_sim("keys")
    assert shown.returncode == 0, shown.stderr
    cells = [
        tuple(cell.strip() for cell in line.split("│")[1:-1])
        for line in shown.stdout.splitlines()
        if line.startswith("│")
    ]
    assert cells == [tuple(row) for row in scene_keys()]


def test_json_is_the_same_of_a_section() -> None:
    shown = ab_sim("keys", "solver.parameters", "--json")
    assert json.loads(shown.stdout) == [row._asdict() for row in scene_keys("solver.parameters")]


def test_an_unknown_section_is_one_error() -> None:
    shown = ab_sim("keys", "rotr")
    assert shown.returncode == 2
    assert shown.stdout == ""
    assert shown.stderr == "ab-sim: 'rotr': a scene has no such key; did you mean 'rotor'?\n"


def test_the_schema_is_printed_or_written(tmp_path: Path) -> None:
    file = tmp_path / "scene.schema.json"
    written = ab_sim("schema", "--out", str(file))
    assert written.returncode == 0, written.stderr
    assert ab_sim("schema").stdout == file.read_text()
    assert json.loads(file.read_text()) == scene_schema()


def test_help_says_how_an_editor_finds_the_schema() -> None:
    help_text = " ".join(ab_sim("schema", "--help").stdout.split())
    assert "# yaml-language-server: $schema=scene.schema.json" in help_text
    assert "ab-sim schema --out scene.schema.json" in help_text

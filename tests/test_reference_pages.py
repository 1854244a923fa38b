"""Generator of the reference pages; ``test_docs`` checks that they are current."""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import ab_sim
from ab_sim.analysis.metrics import described_metrics

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "docs" / "extensions" / "from_code.py"
REFERENCE = ROOT / "docs" / "reference"


def run(script: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, script, *options], capture_output=True, text=True)


def test_a_stale_page_is_named_and_written(tmp_path: Path) -> None:
    """In a copy, where a scene's row is missing."""
    docs = tmp_path / "docs"
    (docs / "reference").mkdir(parents=True)
    for folder in ("extensions", "gallery"):
        (docs / folder).symlink_to(ROOT / "docs" / folder)
    for folder in ("ab_sim", "ab_msgs_py", "config"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    page = docs / "reference" / "scenes.md"
    right = (REFERENCE / "scenes.md").read_text()
    stale = "\n".join(line for line in right.split("\n") if "`no-ball`" not in line)
    assert stale != right
    page.write_text(stale)
    script = docs / "extensions" / "from_code.py"
    checked = run(script, "--check")
    assert (checked.returncode, checked.stdout) == (1, "docs/reference/scenes.md: not current\n")
    assert page.read_text() == stale
    assert run(script).returncode == 0
    assert page.read_text() == right


def test_pages_have_what_they_are_about() -> None:
    for page, row in {
        "commands": "## ab-sim robust",
        "effects": "| `effects.motor.torque_limit` |",
        "nodes": "| `command_age_limit` |",
        "python": "| `ab_sim.simulate` |",
        "results": "| `final_whirl_over_e` |",
        "scene": "| `balls.mass` |",
        "scenes": "| `thesis-hold` |",
        "sensors": "| `sensors.NAME.bandwidth` |",
    }.items():
        assert row in (REFERENCE / f"{page}.md").read_text(encoding="utf-8"), page


def short(name: str) -> ab_sim.Scene:
    return ab_sim.load_scene(name, ["duration=0.05"])


@pytest.mark.parametrize(
    ("section", "inner", "report"),
    [
        ("run", "samples", lambda: ab_sim.simulate(short("no-ball"), [0.01]).report()),
        ("modes", "modes", lambda: ab_sim.modes("couple-unbalance", 500.0).report()),
        ("equilibria", "branches", lambda: ab_sim.equilibria("thesis-hold", 300.0).report()),
        (
            "floquet",
            None,
            lambda: ab_sim.floquet("nsc-case-1", 300.0, start="balanced").report()[0],
        ),
    ],
)
def test_the_page_of_json_names_every_field(
    section: str, inner: str | None, report: Callable[[], dict[str, Any]]
) -> None:
    page = (REFERENCE / "json.md").read_text(encoding="utf-8")
    text = page.partition(f"\n## {section}\n")[2].partition("\n## ")[0]
    named = {*re.findall(r"`(\w+)`", text), "scene", "version"}
    named |= {metric.name for metric in described_metrics(None)}
    result = report()
    fields = {*result, *(result[inner][0] if inner else ())}
    assert len(fields) > 10 and sorted(fields - named) == []

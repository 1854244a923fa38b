"""The page of conventions is named wherever its notation is met, and holds what is referred to."""

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from typer.main import get_command

from ab_sim import conventions
from ab_sim.analysis import Comparison, run_scene
from ab_sim.cli.app import app
from ab_sim.cli.merits import merits_table
from ab_sim.drive.description import describe
from ab_sim.figures.run import run_figure
from ab_sim.recording.drawing import Drawing
from ab_sim.recording.legend import legend_text
from ab_sim.reports.grid import grid_of
from ab_sim.reports.panels import Panel
from ab_sim.reports.picture import report_picture
from ab_sim.reports.summary import CAPTION
from ab_sim.scene import load_scene

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / conventions.PAGE).read_text(encoding="utf-8")
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]


def anchors(text: str) -> set[str]:
    """Of headings, as GitHub makes them."""
    heads = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head).strip().lower().replace(" ", "-") for head in heads}


@pytest.mark.parametrize("link", [conventions.ANGLES, conventions.WHIRL, conventions.MASSES])
def test_sections_are_there(link: str) -> None:
    assert link.partition("#")[2] in anchors(TEXT)


def test_what_the_page_links_is_there() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", TEXT)
    assert "conventions.png" in links
    assert all((ROOT / "docs" / link).exists() for link in links)


@pytest.mark.parametrize("page", ["README.md", "docs/topics.md", "docs/equations.md"])
def test_pages_link_it(page: str) -> None:
    found = re.findall(r"\]\(((?:docs/)?conventions\.md)(#[^)]*)?\)", (ROOT / page).read_text())
    assert found
    assert all(not part or part[1:] in anchors(TEXT) for _, part in found)


@pytest.mark.parametrize(
    "name", ["run", "modes", "equilibria", "stability", "floquet", "recovery", "compare", "report"]
)
def test_helps_name_it(name: str) -> None:
    assert conventions.PAGE in COMMANDS[name].help


def test_tables_pictures_and_recordings_name_it(tmp_path: Path, drawn: list[Figure]) -> None:
    run = run_scene(load_scene("balanced-start-up", ["duration=0.2"]))
    run_figure(run.trajectory, run.scene, tmp_path / "run.png", Comparison(None, None))
    report_picture(grid_of(["a"], [[Panel("speed", "", "", "", note="none")]]), tmp_path / "r.png")
    assert len(drawn) == 2
    for figure in drawn:
        assert any(conventions.PAGE in text.get_text() for text in figure.texts)
    table = merits_table("", run.scene, {}, Comparison(None, None))
    assert conventions.WHIRL in str(table.caption) and conventions.ANGLES in str(table.caption)
    assert conventions.PAGE in CAPTION
    assert conventions.PAGE in legend_text(Drawing.of(describe(run.scene)))

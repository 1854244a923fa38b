"""`ab-sim paper` as a user runs it, and pages."""

import importlib
import re
from pathlib import Path

import pytest
from gallery import PAPERS
from gallery.page import PageSection, Paper, Picture, Table
from gallery.relative_stability.speed import speed_section

from ab_sim.base.presentation import NOTATION
from tests.cli.tool import PNG, ab_sim, refused


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("relative-stabilty",),
            "did you mean 'relative-stability'?; known are: " + ", ".join(PAPERS),
        ),
        (("relative-stability", "--json", "no/r.json"), "there is no folder"),
        (("relative-stability", "--json", "r.png"), "must end in .json"),
        (("relative-stability", "--out", "file/papers"), "--out file/papers: cannot be created"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    assert words in refused("paper", *arguments, cwd=tmp_path)


def test_without_a_name_it_lists_what_there_is() -> None:
    done = ab_sim("paper")
    assert done.returncode == 0
    assert all(name in done.stdout and about[:12] in done.stdout for name, about in PAPERS.items())


def test_a_page_has_all_that_the_report_has_in_markdown() -> None:
    table = Table("Table 1", ("case", "ours [s]", "published [s]"), (("|x|", 1.23456789, None),))
    parts = (PageSection("Heading", ("Text.",), (table,), (Picture("p.png", "What it shows"),)),)
    paper = Paper("name", "Title", "Source.", parts)
    assert paper.markdown() == (
        f"# Title\n\nSource.\n\nWritten by `ab-sim paper name`. {NOTATION}.\n\n"
        "## Heading\n\nText.\n\n"
        "**Table 1**\n\n"
        "| case | ours [s] | published [s] |\n| --- | --- | --- |\n| \\|x\\| | 1.23457 | - |\n\n"
        "![What it shows](p.png)\n\n*What it shows*\n"
    )
    section = paper.report()["sections"][0]
    assert section["tables"][0]["rows"] == [["|x|", 1.23456789, None]]
    assert section["pictures"] == [{"file": "p.png", "caption": "What it shows"}]


def test_a_paper_is_written_with_its_pictures(tmp_path: Path) -> None:
    """Long computations are cached: see ``ab_sim.analysis.result_cache``."""
    folder = tmp_path / "made" / "papers"
    told: list[tuple[str, int, int]] = []
    folder.mkdir(parents=True)
    section = speed_section(folder, lambda *what: told.append(what))
    (picture,) = section.pictures
    assert (folder / picture.file).read_bytes().startswith(PNG)
    assert picture.caption == (
        "Figure 4: from 1000 to 900 rad/s along half a cosine from 10 to 10.11 s"
    )
    assert told == [("figure 4", 0, 1)]


@pytest.mark.parametrize("name", PAPERS)
def test_the_page_that_is_committed_has_its_pictures(name: str) -> None:
    folder = Path(__file__).parents[2] / "docs" / "papers"
    page = (folder / f"{name}.md").read_text(encoding="utf-8")
    pictures = re.findall(r"\]\((.+\.png)\)", page)
    assert pictures and all((folder / picture).is_file() for picture in pictures)
    assert f"Written by `ab-sim paper {name}`." in page


def test_every_paper_has_what_regenerates_it() -> None:
    for name in PAPERS:
        module = importlib.import_module(f"gallery.{name.replace('-', '_')}")
        assert callable(module.regenerate)

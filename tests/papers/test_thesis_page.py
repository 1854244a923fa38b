"""The thesis page as it is in docs/: its head beside its rows, and the thesis' figures."""

import re

from gallery.page import PageSection, Table
from gallery.thesis.head import counted, in_short

from tests.papers.thesis_page import page_sections


def test_the_head_is_that_of_the_rows() -> None:
    head, _, *sections = page_sections()
    assert head.heading == "In five lines"
    assert in_short(sections).text == head.text


def test_only_verdicts_are_counted() -> None:
    columns = ("figure", "the thesis", "ours", "verdict")
    rows = (("1", "a", "b", "holds"), ("2", "a", "b", "does not hold: c"), ("3", "a", "b", "given"))
    section = PageSection(
        "1", (), (Table("t", columns, rows), Table("u", columns[:2], (("x", "y"),)))
    )
    assert counted([section, section]) == (4, 2)


def test_every_figure_has_a_row() -> None:
    """A reader with the thesis open finds each figure of chapters 4 to 6 by its number."""
    cells = " ".join(
        str(row[0]) for each in page_sections() for table in each.tables
        if table.columns[0] == "figure" for row in table.rows
    )  # fmt: skip
    # A section has another number of the same kind.
    figures = set(re.findall(r"\b[456]\.\d+\b", re.sub(r"section \d\.\d", "", cells)))
    shown = [f"4.{k}" for k in range(1, 46)] + [f"5.{k}" for k in range(1, 13)]
    shown += [f"6.{k}" for k in range(3, 7)]
    assert [number for number in shown if number not in figures] == []

"""The thesis page and its report in docs/: the head, the rows, and the thesis' figures."""

import re

from gallery.page import PageSection, Paper, Table
from gallery.thesis import NAME, SOURCE, TITLE
from gallery.thesis.head import counted, in_short
from gallery.thesis.shown import NUMBERS, OPEN, REFUTED, shown

from tests.papers.thesis_page import PAGE, page_sections


def test_the_head_is_that_of_the_rows() -> None:
    head, _, *sections = page_sections()
    assert head.heading == "In five lines"
    assert in_short(sections).text == head.text


def test_the_page_is_that_of_the_report() -> None:
    sections = page_sections()
    page = Paper(NAME, TITLE, SOURCE, sections, shown(sections)).markdown()
    assert PAGE.read_text(encoding="utf-8") == page


def test_the_page_has_numbers_and_what_does_not_hold() -> None:
    columns = ("figure", "the thesis", "ours", "verdict")
    rows = (
        ("1", "peak W/e: about 55", "54.6 (ours: to 5%)", "holds"),
        ("2", "it settles", "yes", "holds"),
        ("3", "it is gone", "1.1 left", "does not hold: too heavy"),
        ("4", "it is gone", "1.2 left", "does not hold: too heavy"),
        ("5", "force: about 2", "1.6 (ours: to 5%)", "undecided: by 15% no, by 20% it does"),
    )
    section = PageSection("1", (), (Table("t", columns, rows), Table("u", ("x",), (("y",),))))
    _, (_, text, (numbers, refuted, undecided, other), _) = shown([PageSection("0"), section])
    assert text == ("Of the statements without a number, 1 hold.",)
    assert (numbers.title, numbers.rows) == (NUMBERS, (("1", "peak W/e: 55", "54.6", "yes"),))
    assert (refuted.title, refuted.rows) == (REFUTED, (("3; 4", "it is gone", "too heavy"),))
    assert (undecided.title, undecided.rows) == (
        OPEN,
        (("5", "force: about 2", "1.6", "by 15% no, by 20% it does"),),
    )
    assert other.title == "u"


def test_the_page_shows_both_readings_of_what_is_undecided() -> None:
    """The order of chapter 6, 4.14 and 4.32 depend on what the thesis does not print."""
    text = PAGE.read_text(encoding="utf-8").partition(f"**{OPEN}**")
    rows = re.findall(r"^\| ([\d.(), a-z]+) \| .* \| .* \| (.+) \|$", text[2], re.M)
    because = [(figure, why) for figure, why in rows if " not" in why]
    assert {"4.14 (c)", "4.32", "6.3, 6.4", "6.4", "6.4 (c), 4.14"} <= {one for one, _ in because}
    orders = [why for figure, why in because if figure in ("6.3, 6.4", "6.4")]
    assert len(orders) == 3
    assert all("it does not hold, with R = 12 mm" in why and " it does: " in why for why in orders)


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

"""The thesis page: published numbers beside ours, statements that do not hold, and undecided ones.

The report (``docs/papers/thesis.json``) has every statement with its verdict.
"""

import re
from collections.abc import Sequence

from gallery.page import PageSection, Table
from gallery.thesis.claims import FAILS, HOLDS, UNDECIDED

NUMBERS, REFUTED = "Published numbers", "Statements that do not hold"
OPEN = "Undecided statements"
"""Titles of the tables."""
CRITERION = re.compile(r" \((?:ours|the English): [^()]*(?:\([^()]*\)[^()]*)*\)")
"""A remark in brackets, which the report has."""
NO_NUMBER = re.compile(
    r"figures? [\d.]+|sections? [\d.]+|chapters? [\d.]+|that of [\d.]+|(?:in|as|of|than|to) \d\.\d+"
    r"|-\d+ deg|\b[mc]_?b? = [\d.]+ ?g?|[\d.]+ rpm|0\.5 s\b|[\d.]+ s after the critical speed"
    r"|table [\d.]+|\d\.\d+ \(\w\)"
)
"""Digits of a statement that are no result: figures, settings, opposite positions."""
RESULT = re.compile(r"about -?\d|\d(?: s| N| deg)?\b")


EVERYTHING = (
    "Every statement with its verdict and criterion is in [thesis.json](thesis.json), which "
    "`ab-sim paper thesis --json thesis.json` writes."
)
REPORT_ONLY = ("Table 4.1", "Best start speed", "Ours: what is left")
"""Beginnings of the titles of tables that only the report has."""
LONG = 14
"""Words of a finding above which the page shows its first part only."""


def shown(sections: Sequence[PageSection]) -> tuple[PageSection, ...]:
    """Return the sections of the page, with three tables in place of all statements."""
    head, *others = sections
    head = head._replace(text=(*head.text, EVERYTHING))
    return head, *(_shown(section) for section in others)


def _shown(section: PageSection) -> PageSection:
    judged = [table for table in section.tables if table.columns[-1] == "verdict"]
    if not judged:
        return section
    every = [row for table in judged for row in table.texts()]
    undecided = [row for row in every if row[-1].startswith(UNDECIDED)]
    rows = [row for row in every if row not in undecided]
    numbers = [row for row in rows if _has_number(row[1])]
    others = [row for row in rows if not _has_number(row[1])]
    hold = sum(row[-1] == HOLDS for row in others)
    tables = []
    if numbers:
        columns = ("figure", "published", "ours", "holds")
        tables.append(Table(NUMBERS, columns, tuple(map(_number, numbers))))
    if refuted := _refuted(others):
        tables.append(Table(REFUTED, ("figure", "the thesis", "ours"), refuted))
    if undecided:
        columns = ("figure", "the thesis", "ours", "undecided because")
        tables.append(Table(OPEN, columns, tuple(map(_open, undecided))))
    text = f"Of the statements without a number, {hold} hold."
    rest = [
        table for table in section.tables
        if table.columns[-1] != "verdict" and not table.title.startswith(REPORT_ONLY)
    ]  # fmt: skip
    return section._replace(text=(*section.text, text), tables=(*tables, *rest))


def _has_number(printed: str) -> bool:
    return (
        "about" in printed
        and bool(RESULT.search(NO_NUMBER.sub("", printed)))
        or (bool(re.search(r"about -?[\d.]|settled in", printed)))
    )


def _number(row: list[str]) -> tuple[str, ...]:
    figure, printed, ours, verdict = row
    printed = CRITERION.sub("", printed).replace("about ", "")
    holds = {HOLDS: "yes"}.get(verdict, verdict.replace(FAILS, "no"))
    return figure, printed, CRITERION.sub("", ours), holds.partition(";")[0]


def _open(row: list[str]) -> tuple[str, ...]:
    figure, printed, ours, verdict = (CRITERION.sub("", cell) for cell in row)
    return figure, printed, ours, verdict.removeprefix(f"{UNDECIDED}: ")


def _refuted(rows: Sequence[list[str]]) -> tuple[tuple[str, ...], ...]:
    """Return one row per finding; figures with the same finding share it."""
    found: dict[tuple[str, str], list[str]] = {}
    for figure, printed, ours, verdict in rows:
        if verdict.startswith(FAILS):
            why = verdict.partition(": ")[2] or CRITERION.sub("", ours)
            if len(why.split()) > LONG:
                why = why.partition("; ")[0]
            found.setdefault((CRITERION.sub("", printed), why), []).append(figure)
    return tuple(("; ".join(figures), *texts) for texts, figures in found.items())

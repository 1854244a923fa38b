"""What a paper's report is made of, and the report as a page of Markdown."""

import re
from collections.abc import Iterator
from html import escape
from typing import Any, NamedTuple

import ab_sim
from ab_sim.base.presentation import NOTATION

Cell = str | float | None
LONGEST_OPEN = 6
"""Largest number of rows of a table that a page does not fold."""


class Table(NamedTuple):
    """A table of values, usually ours next to the published ones."""

    title: str
    columns: tuple[str, ...]
    """Names, with units."""
    rows: tuple[tuple[Cell, ...], ...]
    """None where there is no value."""
    digits: int = 6
    """Significant ones that a page shows."""
    on_page: bool = True
    """False: only the report has it."""

    def texts(self) -> list[list[str]]:
        """The rows for people."""
        return [[self._text(cell) for cell in row] for row in self.rows]

    def _text(self, cell: Cell) -> str:
        if cell is None:
            return "-"
        return cell if isinstance(cell, str) else f"{cell:.{self.digits}g}"


class Picture(NamedTuple):
    """A picture that has been written."""

    file: str
    """Its name in the folder."""
    caption: str

    @property
    def short(self) -> str:
        """Alternative text: the caption up to its first semicolon or full stop."""
        return re.split(r"; |\. ", self.caption)[0]


class PageSection(NamedTuple):
    """A stretch of the page; a heading, then all that belongs to it, in this order."""

    heading: str
    text: tuple[str, ...] = ()
    """Paragraphs, in Markdown."""
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()


class Paper(NamedTuple):
    """A paper, computed again."""

    name: str
    """Short, as ``ab-sim paper`` knows it."""
    title: str
    source: str
    """Who published it, where and when."""
    sections: tuple[PageSection, ...]
    shown: tuple[PageSection, ...] = ()
    """Sections of the page if it shows less than the report."""

    def report(self) -> dict[str, Any]:
        """Everything as JSON-able values: see ``ab-sim paper --help``."""
        return {
            "paper": self.name,
            "title": self.title,
            "source": self.source,
            "sections": [
                {
                    "heading": section.heading,
                    "text": list(section.text),
                    "tables": [
                        {
                            "title": t.title,
                            "columns": list(t.columns),
                            "rows": list(map(list, t.rows)),
                            "digits": t.digits,
                        }
                        for t in section.tables
                    ],
                    "pictures": [picture._asdict() for picture in section.pictures],
                }
                for section in self.sections
            ],
            "version": ab_sim.__version__,
        }

    def markdown(self) -> str:
        """The page, for beside its pictures."""
        written = f"Written by `ab-sim paper {self.name}`. {NOTATION}."
        parts = [f"# {self.title}", self.source, written]
        for section in self.shown or self.sections:
            parts += [f"## {section.heading}", *section.text]
            for table in (table for table in section.tables if table.on_page):
                parts += _shown(table)
            for picture in section.pictures:
                parts += [f"![{picture.short}]({picture.file})", f"*{picture.caption}*"]
        return "\n\n".join(parts) + "\n"


def _shown(table: Table) -> list[str]:
    """Return a table's title and rows; long tables are folded."""
    rows = "\n".join(_lines(table))
    if len(table.rows) <= LONGEST_OPEN:
        return [f"**{table.title}**", rows]
    summary = f"<summary>{escape(table.title)} ({len(table.rows)} rows)</summary>"
    return [f"<details>{summary}", rows, "</details>"]


def _lines(table: Table) -> Iterator[str]:
    """Yield the rows of a table in Markdown, with escaped bars."""
    rows = [list(table.columns), ["---"] * len(table.columns), *table.texts()]
    for row in rows:
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"

"""Report on the thesis as in docs/: its sections with their tables."""

import json
from pathlib import Path

from gallery.page import PageSection, Picture, Table
from gallery.thesis.claims import FAILS, HOLDS, Claim

PAGE = Path(__file__).parents[2] / "docs" / "papers" / "thesis.md"


def page_sections() -> tuple[PageSection, ...]:
    """Return the sections of the report, with all tables."""
    report = json.loads(PAGE.with_suffix(".json").read_text(encoding="utf-8"))
    return tuple(
        PageSection(
            section["heading"],
            tuple(section["text"]),
            tuple(
                Table(t["title"], tuple(t["columns"]), tuple(map(tuple, t["rows"])), t["digits"])
                for t in section["tables"]
            ),
            tuple(Picture(**picture) for picture in section["pictures"]),
        )
        for section in report["sections"]
    )


def verdicts_on_page(section: str) -> list[tuple[str, str, str]]:
    """Return figure, statement and kind of verdict of each row of a section.

    Parameters
    ----------
    section
        Beginning of the section's heading.
    """
    (found,) = [each for each in page_sections() if each.heading.startswith(section)]
    return [
        (str(row[0]), str(row[1]), _kind(str(row[-1])))
        for table in found.tables if table.columns[-1] == "verdict" for row in table.rows
    ]  # fmt: skip


def verdicts_of(claims: list[Claim]) -> list[tuple[str, str, str]]:
    """Return figure, statement and kind of verdict of each claim."""
    return [(claim.figure, claim.printed, _kind(claim.verdict)) for claim in claims]


def _kind(verdict: str) -> str:
    return FAILS if verdict.startswith(FAILS) else HOLDS if verdict == HOLDS else "no result"

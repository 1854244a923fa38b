"""The thesis page as it is in docs/, read back: its sections with their tables."""

from pathlib import Path

from gallery.page import PageSection, Table
from gallery.thesis.claims import FAILS, HOLDS, Claim

PAGE = Path(__file__).parents[2] / "docs" / "papers" / "thesis.md"


def page_sections() -> list[PageSection]:
    """Headings, paragraphs and tables; pictures are left out."""
    sections: list[PageSection] = []
    title, rows = "", list[tuple[str, ...]]()
    for line in [*PAGE.read_text(encoding="utf-8").splitlines(), ""]:
        if line.startswith("## "):
            sections.append(PageSection(line[3:]))
        elif line.startswith("| "):
            rows.append(tuple(cell.strip() for cell in line[1:-1].split(" | ")))
        elif rows:
            table = Table(title, rows[0], tuple(rows[2:]))
            sections[-1] = sections[-1]._replace(tables=(*sections[-1].tables, table))
            rows = []
        elif line.startswith("**"):
            title = line.strip("*")
        elif line and sections and not line.startswith(("!", "*")):
            sections[-1] = sections[-1]._replace(text=(*sections[-1].text, line))
    return sections


def verdicts_on_page(section: str) -> list[tuple[str, str, str]]:
    """Figure, statement and the kind of its verdict, of the section whose heading begins so."""
    (found,) = [each for each in page_sections() if each.heading.startswith(section)]
    return [
        (str(row[0]), str(row[1]), _kind(str(row[-1])))
        for table in found.tables if table.columns[-1] == "verdict" for row in table.rows
    ]  # fmt: skip


def verdicts_of(claims: list[Claim]) -> list[tuple[str, str, str]]:
    """The same of claims."""
    return [(claim.figure, claim.printed, _kind(claim.verdict)) for claim in claims]


def _kind(verdict: str) -> str:
    return FAILS if verdict.startswith(FAILS) else HOLDS if verdict == HOLDS else "no result"

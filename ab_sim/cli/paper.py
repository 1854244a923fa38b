"""`ab-sim paper`."""

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from rich.table import Table

from ab_sim.base.errors import InputError
from ab_sim.base.files import check_can_be_made, check_writable, write_whole
from ab_sim.base.presentation import Progress
from ab_sim.cli.analysis_commands import PaperOptions
from ab_sim.cli.runner import Command, Outcome

if TYPE_CHECKING:
    from gallery import page as pages

_DOCS = Path(__file__).parents[2] / "docs"
"""Folder of the docs in a checkout from which ab_sim is installed editable, or run."""


def gallery() -> ModuleType:
    """Return the package of papers, which is part of the sources of ab_sim.

    Raises
    ------
    InputError
        ab_sim was installed without its sources.
    """
    if not (_DOCS / "gallery" / "__init__.py").is_file():
        raise InputError(
            f"paper: the papers are part of the sources of ab_sim, and not of the installation in "
            f"{_DOCS.parent}; in a checkout of the sources run `make demo` once, then "
            "`.venv/bin/ab-sim paper`. The checkout also has the resulting pages: docs/papers"
        )
    # First in the path, so that another package named gallery is not imported.
    sys.path.insert(0, str(_DOCS))
    return importlib.import_module("gallery")


def paper_command(options: PaperOptions) -> Command:
    """Return the command that lists the papers, or reproduces one and writes page and pictures."""
    papers = gallery()
    name, out = options.name, options.out
    if name is None:
        table = Table("paper", "subject")
        for paper_name, about in papers.PAPERS.items():
            table.add_row(paper_name, about)
        return Command(lambda _: Outcome([table], lambda: {"papers": dict(papers.PAPERS)}))
    papers.check_known(name)
    page = out / f"{name}.md"

    def work(tell: Progress) -> Outcome:
        check_can_be_made(out, "--out")
        if out.exists():
            check_writable(page, "--out")
        paper: pages.Paper = papers.regenerate(name, out, tell)
        try:
            write_whole(page, paper.markdown().encode())
        except OSError as error:
            raise InputError(f"--out {out}: {page} cannot be written: {error.strerror}") from error
        tables = [_table(table) for section in paper.sections for table in section.tables]
        drawn = [out / picture.file for section in paper.sections for picture in section.pictures]
        return Outcome(tables, paper.report, written=[*drawn, page])

    return Command(work, name)


def _table(paper_table: "pages.Table") -> Table:
    """Return a table for display."""
    table = Table(*paper_table.columns, title=paper_table.title)
    for row in paper_table.texts():
        table.add_row(*row)
    return table

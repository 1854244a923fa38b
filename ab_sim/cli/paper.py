"""`ab-sim paper`."""

from pathlib import Path

from rich.table import Table

from ab_sim.cli.outputs import check_outputs, console_beside, say_written, write_json
from ab_sim.cli.progress import progress_bar
from ab_sim.errors import InputError
from ab_sim.output_file import check_can_be_made, check_writable, write_whole
from ab_sim.papers import check_known, regenerate
from ab_sim.papers import page as pages


def paper_command(name: str, out: Path, json: str | None) -> None:
    """Compute, draw, print, and write; outputs are tried first."""
    check_known(name)
    page = out / f"{name}.md"
    files = check_outputs(json, None)
    check_can_be_made(out, "--out")
    if out.exists():
        check_writable(page, "--out")
    with progress_bar(name) as tell:
        paper = regenerate(name, out, tell)
    try:
        write_whole(page, paper.markdown().encode())
    except OSError as error:
        raise InputError(f"--out {out}: {page} cannot be written: {error.strerror}") from error
    if json is not None:
        write_json(paper.report(), json)
    console = console_beside(json)
    for section in paper.sections:
        for each in section.tables:
            console.print(_table(each))
    pictures = [out / picture.file for section in paper.sections for picture in section.pictures]
    say_written([*pictures, page, *files])


def _table(each: pages.Table) -> Table:
    """The table for people."""
    table = Table(*each.columns, title=each.title)
    for row in each.texts():
        table.add_row(*row)
    return table

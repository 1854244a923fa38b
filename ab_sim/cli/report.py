"""`ab-sim report`."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from ab_sim.cli.progress import Tell, interruptible
from ab_sim.cli.runner import Command, Outcome
from ab_sim.errors import InputError
from ab_sim.output_file import PAGE, PNG
from ab_sim.recording import open_recording
from ab_sim.reports.gather import RunData, gather
from ab_sim.reports.summary import CAPTION, summary_rows

MOST_RUNS = 8
"""Largest number of runs side by side; more would be too small to see."""


def report_command(recordings: Sequence[Path], png: Path | None, html: Path | None) -> Command:
    """Return the command that reports on recorded runs."""
    if len(recordings) > MOST_RUNS:
        raise InputError(f"{len(recordings)} recordings: at most {MOST_RUNS} side by side")

    def work(_: Tell) -> Outcome:
        opened = [open_recording(recording) for recording in recordings]
        runs = []
        for run, name in zip(opened, _names(recordings), strict=True):
            with interruptible(name, "nothing was written") as tell:
                runs.append(
                    gather(run, name, lambda done, of, tell=tell: tell("samples", done, of))  # type: ignore[misc]
                )
        return Outcome(
            [report_table(runs), *(f"{data.name}: {note}" for data in runs for note in data.notes)],
            lambda: {"runs": [data.report() for data in runs]},
            writes=(lambda: _draw(runs, png, None), lambda: _draw(runs, None, html)),
        )

    return Command(work, outputs=[(png, PNG, "--png"), (html, PAGE, "--html")])


def report_table(runs: Sequence[RunData]) -> Table:
    """Return the table of runs."""
    table = Table(caption=CAPTION, caption_justify="left")
    table.add_column("", no_wrap=True)
    for data in runs:
        table.add_column(data.name, overflow="fold")
    for label, cells in summary_rows(runs):
        table.add_row(label, *cells)
    return table


def _names(recordings: Sequence[Path]) -> list[str]:
    """Return the names of files, with as much of their folders as distinguishes them."""
    stems = [path.stem for path in recordings]
    if len(set(stems)) == len(stems):
        return stems
    paths = [str(path) for path in recordings]
    numbered = [f"{path} ({at})" for at, path in enumerate(paths, 1)]
    return paths if len(set(paths)) == len(paths) else numbered


def _draw(runs: Sequence[RunData], png: Path | None, html: Path | None) -> None:
    if png is None and html is None:
        return
    from ab_sim.reports.grid import grid_of
    from ab_sim.reports.panels import panels_of

    grid = grid_of([data.name for data in runs], [panels_of(data) for data in runs])
    try:
        if png is not None:
            from ab_sim.reports.picture import report_picture

            report_picture(grid, png)
        if html is not None:
            from ab_sim.reports.page import report_page

            report_page(grid, summary_rows(runs), [data.notes for data in runs], html)
    except OSError as error:
        raise InputError(f"a picture cannot be written: {error.strerror}") from error

"""Commands with results: check the output files, work, write the files, print the results."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table

from ab_sim.base.errors import InputError, NothingFound
from ab_sim.base.files import PICTURE, REPORT, write_whole
from ab_sim.base.presentation import Progress, drawn
from ab_sim.cli.outputs import (
    Output,
    check_files,
    people,
    print_written,
    results,
    write_json,
)
from ab_sim.cli.progress import interruptible, progress_bar

Write = Callable[[Path], list[Path] | None]
"""Function that writes a file; for a folder it returns the files in it."""
Draw = Callable[[Path], None]
"""Function that draws a picture into a file."""
_DOTS, FINE = 110, 120
"""Resolution of pictures without and with many labels [dots per inch]."""


class WholeLine(str):
    """Line that is not wrapped, so that it can be copied."""


class Outcome(NamedTuple):
    """Result of a command's work."""

    printed: Iterable[Table | str]
    """Tables and summaries, generated after all files have been written. With ``--json -`` they go
    to standard error."""
    report: Callable[[], dict[str, Any]] = dict
    """Function that returns the content of the JSON."""
    draw: Draw | None = None
    """Function that draws the picture; None: there is nothing to draw."""
    writes: Mapping[str, Write | None] = {}
    """Functions that write the command's ``outputs``, by option; None: nothing to write."""
    written: Sequence[Path] = ()
    """Files that the command wrote while it worked, to be named at the end."""
    failure: str | None = None
    """Error with which the command exits if a search found nothing: reason and remedy."""


class Command(NamedTuple):
    """Command whose arguments have been checked."""

    work: Callable[[Progress], Outcome]
    """Function that does the work; its argument is a progress callback."""
    bar: str | None = None
    """Name in front of the progress bar; None: no bar."""
    kept_files: str | None = None
    """Text on the files that remain after Ctrl-C; None: Ctrl-C ends the process immediately."""
    outputs: Sequence[Output] = ()
    """Files that the command writes, other than JSON and picture."""

    def run(self, json: str | None = None, plot: Path | None = None) -> None:
        """Run the command, with the values of ``--json`` and ``--plot``.

        Raises
        ------
        InputError
            An output cannot be written. All outputs are checked before the work; if one fails
            nevertheless, the others are still written.
        NothingFound
            The search found nothing.
        """
        to_stdout = json == "-"
        outputs: list[Output] = [
            (None if json is None else Path(json), () if to_stdout else REPORT, "--json"),
            (plot, PICTURE, "--plot"),
            *self.outputs,
        ]
        check_files(*outputs)
        with self._progress() as tell:
            outcome = self.work(tell)

        def write_report(file: Path) -> list[Path]:
            write_json(outcome.report(), str(file))
            return [] if to_stdout else [file]

        writes = {"--json": write_report, "--plot": outcome.draw, **outcome.writes}
        written, failures = [*outcome.written], list[Exception]()
        for file, _, option in outputs:
            if file is not None and (write := writes.get(option)) is not None:
                # Hours of work must not be lost because one of several files cannot be written.
                try:
                    written += _written(write, file, option)
                except Exception as error:
                    failures.append(error)
        console = people if to_stdout else results
        for item in outcome.printed:
            console.print(item, soft_wrap=isinstance(item, WholeLine))
        if failures:
            raise failures[0]
        print_written(written)
        if outcome.failure is not None:
            raise NothingFound(outcome.failure)

    def _progress(self) -> AbstractContextManager[Progress]:
        """Return the context in which the command works, which yields the progress callback."""
        if self.bar is None:
            return nullcontext(lambda *_: None)
        if self.kept_files is None:
            return progress_bar(self.bar)
        return interruptible(self.bar, self.kept_files)


def _written(write: Write, file: Path, option: str) -> Iterable[Path]:
    """Write an output, and return the written files.

    Raises
    ------
    InputError
        The file cannot be written; the message has option, file and reason.
    """
    try:
        files = write(file)
    except OSError as error:
        raise InputError(f"{option} {file}: cannot be written: {error.strerror}") from error
    return [file] if files is None else files


def picture(name: str, *results: Any, dots: int = _DOTS) -> Draw:
    """Return a function that draws results into a file.

    Parameters
    ----------
    name
        Name of the picture in ``ab_sim.show.result_figures.DRAWN``.
    results
        Results to draw, as the picture takes them.
    dots
        Resolution [dots per inch].
    """

    def draw(file: Path) -> None:
        from ab_sim.show.saved import save  # matplotlib takes long to import

        save(drawn(name, *results), file, dots)

    return draw


def scene_writer(text: Callable[[], str]) -> Write:
    """Return a function that writes a scene file, whose text ``text`` returns."""
    return lambda file: write_whole(file, text().encode())


def new_table(left_columns: str, right: str, no_wrap: bool = False, **settings: Any) -> Table:
    """Return a table with left-aligned and then right-aligned columns.

    Parameters
    ----------
    left, right
        Names of the columns, as ``a | b``.
    no_wrap
        Whether texts of left-aligned columns are not wrapped.
    settings
        Settings of rich's ``Table``.
    """
    table = Table(**settings)
    for name in left_columns.split(" | ") if left_columns else ():
        table.add_column(name, no_wrap=no_wrap)
    for name in right.split(" | ") if right else ():
        table.add_column(name, justify="right")
    return table

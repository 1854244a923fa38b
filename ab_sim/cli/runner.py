"""Order of the steps of commands with results: check outputs, work, write, print."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table

from ab_sim.cli.outputs import PlainConsole, check_files, people, say_written, write_json
from ab_sim.cli.progress import Tell, interruptible, progress_bar
from ab_sim.errors import NothingFound
from ab_sim.output_file import PICTURE, REPORT
from ab_sim.presentation import Presented

Draw = Callable[[Path], None]
DOTS = 110
"""Resolution of pictures [dots per inch]."""


class WholeLine(str):
    """Line that is not wrapped, so that it can be copied."""


class Outcome(NamedTuple):
    """Result of a command's work."""

    shown: Iterable[Table | str]
    """Output for people; it is generated after everything has been written."""
    report: Callable[[], dict[str, Any]] = dict
    """Function that returns the content of the JSON."""
    draw: Draw | None = None
    """Function that draws the picture; None: there is nothing to draw."""
    writes: Sequence[Callable[[], None]] = ()
    """Functions that write the command's ``outputs``; empty: the work has written them."""
    written: Sequence[Path] = ()
    """Other files that the work has written."""
    missing: Sequence[Path] = ()
    """Those of the command's ``outputs`` for which there was nothing to write."""
    failure: str | None = None
    """Reason and remedy if a search found nothing: the error with which the command exits."""


class Command(NamedTuple):
    """A command whose arguments have been checked."""

    work: Callable[[Tell], Outcome]
    """Function that does the work; its argument is a progress callback."""
    bar: str | None = None
    """Name at the progress bar; None: no bar."""
    left: str | None = None
    """Text on the files that remain after Ctrl-C, if the work ends in order; None: it ends at
    once."""
    outputs: Sequence[tuple[Path | None, Sequence[str], str]] = ()
    """Files other than JSON and picture, with their endings and options."""
    aside: bool = False
    """True if output for people never goes to standard output."""

    def run(self, json: str | None = None, plot: Path | None = None) -> None:
        """Run the command, with the values of ``--json`` and ``--plot``."""
        report = None if json in (None, "-") else Path(str(json))
        files = check_files((report, REPORT, "--json"), (plot, PICTURE, "--plot"), *self.outputs)
        with self._progress() as tell:
            found = self.work(tell)
        writes, draw = list(found.writes), found.draw
        if plot is not None and draw is None:
            files.remove(plot)
        elif plot is not None and draw is not None:
            writes.insert(0, partial(draw, plot))
        if json is not None:
            writes.insert(0, lambda: write_json(found.report(), json))
        # Hours of work must not be lost because one of several files cannot be written.
        failures: list[Exception] = []
        for write in writes:
            try:
                write()
            except Exception as error:
                failures.append(error)
        console = people if self.aside or json == "-" else PlainConsole()
        written = [file for file in (*found.written, *files) if file not in found.missing]
        for each in found.shown:
            console.print(each, soft_wrap=isinstance(each, WholeLine))
        if failures:
            raise failures[0]
        say_written(written)
        if found.failure is not None:
            raise NothingFound(found.failure)

    def _progress(self) -> AbstractContextManager[Tell]:
        if self.bar is None:
            return nullcontext(lambda *_: None)
        return progress_bar(self.bar) if self.left is None else interruptible(self.bar, self.left)


def picture(function: str, *shown: Any) -> Draw:
    """Return a function that draws with ``module:function``, called with the results and the file.

    The module is imported on the call, because matplotlib takes long to import.
    """

    def draw(file: Path) -> None:
        module, _, name = function.partition(":")
        getattr(import_module(module), name)(*shown, file)

    return draw


def plotted(found: Presented) -> Draw:
    """Return a function that draws the result's ``plot()`` into a file."""

    def draw(file: Path) -> None:
        from ab_sim.figures.saved import save

        save(found.plot(), file, DOTS)

    return draw

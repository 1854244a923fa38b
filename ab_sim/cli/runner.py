"""The order that holds for commands with results: try outputs, work, write, show."""

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
"""Per inch, of pictures."""


class WholeLine(str):
    """A line to be copied: it is not wrapped."""


class Outcome(NamedTuple):
    """What a command's work came to."""

    shown: Iterable[Table | str]
    """For people; it is gone through after everything has been written."""
    report: Callable[[], dict[str, Any]] = dict
    """Makes what the JSON has."""
    draw: Draw | None = None
    """Draws into a picture; None: there is nothing to draw."""
    writes: Sequence[Callable[[], None]] = ()
    """Writers of the command's ``outputs``; none: the work has written them."""
    written: Sequence[Path] = ()
    """What else the work has written."""
    missing: Sequence[Path] = ()
    """Of the command's ``outputs``, what there was nothing to write to."""
    failure: str | None = None
    """Why a search has found nothing, and what to do: the error that the command ends with."""


class Command(NamedTuple):
    """A command whose words have been checked."""

    work: Callable[[Tell], Outcome]
    """Is given what to call with (what is done now, done, of all)."""
    bar: str | None = None
    """Name at the progress bar; None: there is no bar."""
    left: str | None = None
    """What Ctrl-C leaves, if the work is to end in order; else it ends at once."""
    outputs: Sequence[tuple[Path | None, Sequence[str], str]] = ()
    """Beside JSON and picture: file, endings, option."""
    aside: bool = False
    """What is for people never goes to standard output."""

    def run(self, json: str | None = None, plot: Path | None = None) -> None:
        """Run it, with what was given to ``--json`` and ``--plot``."""
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
        # Work of hours is not lost because one file of several cannot be written.
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
    """What draws into a file with ``module:function``, called with what is shown and the file.

    It is imported when it is called, as matplotlib takes long.
    """

    def draw(file: Path) -> None:
        module, _, name = function.partition(":")
        getattr(import_module(module), name)(*shown, file)

    return draw


def plotted(found: Presented) -> Draw:
    """What draws into a file what the result's ``plot()`` shows."""

    def draw(file: Path) -> None:
        from ab_sim.figures.saved import save

        save(found.plot(), file, DOTS)

    return draw

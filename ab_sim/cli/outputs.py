"""Output of commands: consoles, files, and the name of `ab-sim` in hints."""

import json
import shlex
import shutil
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from ab_sim.base.errors import InputError, visible
from ab_sim.base.files import (
    check_ending,
    check_writable,
    write_whole,
)
from ab_sim.base.presentation import finite


class PlainConsole(Console):
    """Console for plain text: no markup, and control characters in texts are made visible.

    Parameters
    ----------
    aside
        Whether to write to standard error.
    """

    def __init__(self, aside: bool = False) -> None:
        super().__init__(stderr=aside, markup=False)

    def render_str(self, text: str, **how: Any) -> Text:
        """Make control characters of a text visible before rich measures its width."""
        return super().render_str(visible(text), **how)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Make control characters visible in everything that is printed."""
        for part in super().render(renderable, options):
            yield part if part.control else Segment(visible(part.text), part.style)


results = PlainConsole()
"""Console on standard output, for results: tables and summaries."""
people = PlainConsole(aside=True)
"""Console on standard error, for progress, notes and the names of written files."""


Output = tuple[Path | None, Sequence[str], str]
"""Path of a file or folder to write, its allowed endings (none for a folder), and the command-line
option that gives it."""


def check_files(*outputs: Output) -> None:
    """Check the requested files before any work is done."""
    for path, endings, option in outputs:
        if path is not None and endings:
            check_ending(path, endings, option)
            check_writable(path, option)


def print_written(files: Iterable[Path]) -> None:
    """Print the names of the written files."""
    for file in files:
        people.print(f"wrote {file}")


def write_json(report: dict[str, Any], file: str) -> None:
    """Write a report to a file, or with ``-`` to standard output.

    Non-finite numbers become null, with their reasons in ``not_finite``.

    Raises
    ------
    InputError
        The file cannot be written; the message has the reason.
    """
    text = json.dumps(finite(report), indent=1, allow_nan=False)
    if file == "-":
        print(text)
        return
    try:
        write_whole(Path(file), f"{text}\n".encode())
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from error


def own_command() -> str:
    """Return the command that starts this program: `ab-sim`, or its path.

    A shell needs the path if the environment is not activated. It is relative if it is below the
    working directory.
    """
    script = Path(sys.executable).with_name("ab-sim")
    if (path := shutil.which("ab-sim")) and (not script.exists() or script.samefile(path)):
        return "ab-sim"
    if not script.exists():
        return f"{shlex.quote(sys.executable)} -m ab_sim"
    here = Path.cwd()
    return shlex.quote(str(script.relative_to(here) if script.is_relative_to(here) else script))

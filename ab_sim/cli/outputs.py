"""Where a command's results go, tried before any work is done."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from ab_sim.errors import InputError
from ab_sim.output_file import (
    check_ending,
    check_writable,
    write_whole,
)
from ab_sim.presentation import finite_or_none
from ab_sim.quoting import visible


class PlainConsole(Console):
    """Text for people: nothing in it is markup, and nothing from outside acts on the terminal.

    Args:
        aside: to standard error.
    """

    def __init__(self, aside: bool = False) -> None:
        super().__init__(stderr=aside, markup=False)

    def render_str(self, text: str, **how: Any) -> Text:
        """As rich's, before it finds out how much room there is."""
        return super().render_str(visible(text), **how)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """As rich's, of which all that is printed is made."""
        for part in super().render(renderable, options):
            yield part if part.control else Segment(visible(part.text), part.style)


people = PlainConsole(aside=True)
"""Results may go to standard output; everything that is only for people goes here."""


def check_files(*outputs: tuple[Path | None, Sequence[str], str]) -> list[Path]:
    """Of files with their endings and options, those that were asked for, after trying them."""
    files: list[Path] = []
    for path, endings, option in outputs:
        if path is not None:
            check_ending(path, endings, option)
            check_writable(path, option)
            files.append(path)
    return files


def say_written(files: list[Path]) -> None:
    """Name the files that were written."""
    for file in files:
        people.print(f"wrote {file}")


def write_json(report: dict[str, Any], file: str) -> None:
    """Write a report to a file, or with ``-`` to standard output; numbers not finite are null.

    Raises:
        InputError: the file cannot be written; names it and the reason.
    """
    text = json.dumps(finite_or_none(report), indent=1, allow_nan=False)
    if file == "-":
        print(text)
        return
    try:
        write_whole(Path(file), f"{text}\n".encode())
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from error


def write_scene(text: str, file: Path) -> None:
    """Write a scene's text to the file of ``--scene``.

    Raises:
        InputError: it cannot be written; names it and the reason.
    """
    try:
        write_whole(file, text.encode())
    except OSError as error:
        raise InputError(f"--scene {file}: cannot be written: {error.strerror}") from error

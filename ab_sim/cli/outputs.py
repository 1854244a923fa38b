"""Destinations of a command's results, checked before any work is done."""

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
    """Console for plain text, without markup or control characters from outside.

    Args:
        aside: write to standard error.
    """

    def __init__(self, aside: bool = False) -> None:
        super().__init__(stderr=aside, markup=False)

    def render_str(self, text: str, **how: Any) -> Text:
        """Make text visible before rich measures its width."""
        return super().render_str(visible(text), **how)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Make all rendered text visible; everything printed passes through here."""
        for part in super().render(renderable, options):
            yield part if part.control else Segment(visible(part.text), part.style)


people = PlainConsole(aside=True)
"""Console on standard error for people; results may go to standard output."""


def check_files(*outputs: tuple[Path | None, Sequence[str], str]) -> list[Path]:
    """Check the requested files with their endings and options, and return those that are given."""
    files: list[Path] = []
    for path, endings, option in outputs:
        if path is not None:
            check_ending(path, endings, option)
            check_writable(path, option)
            files.append(path)
    return files


def say_written(files: list[Path]) -> None:
    """Print the names of the written files."""
    for file in files:
        people.print(f"wrote {file}")


def write_json(report: dict[str, Any], file: str) -> None:
    """Write a report to a file, or with ``-`` to standard output; non-finite numbers become null.

    Raises:
        InputError: the file cannot be written; the message has the reason.
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
        InputError: the file cannot be written; the message has the reason.
    """
    try:
        write_whole(file, text.encode())
    except OSError as error:
        raise InputError(f"--scene {file}: cannot be written: {error.strerror}") from error

"""Where a command's results go, tried before any work is done."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from ab_sim.errors import InputError
from ab_sim.output_file import PICTURE, RECORDING, REPORT, check_ending, check_writable

# Results may go to standard output; everything that is only for people goes here.
people = Console(stderr=True, markup=False)


def check_outputs(json_file: str | None, plot: Path | None, rrd: Path | None = None) -> list[Path]:
    """The files that a command will write, after trying them; ``-`` is standard output."""
    report = None if json_file in (None, "-") else Path(str(json_file))
    return check_files(
        (report, REPORT, "--json"), (plot, PICTURE, "--plot"), (rrd, RECORDING, "--rrd")
    )


def check_files(*outputs: tuple[Path | None, Sequence[str], str]) -> list[Path]:
    """Of files with their endings and options, those that were asked for, after trying them."""
    files: list[Path] = []
    for path, endings, option in outputs:
        if path is not None:
            check_ending(path, endings, option)
            check_writable(path, option)
            files.append(path)
    return files


def console_beside(json_file: str | None) -> Console:
    """Where what is for people goes: aside, where standard output is the report's."""
    return people if json_file == "-" else Console(markup=False)


def say_written(files: list[Path]) -> None:
    """Name the files that were written."""
    for file in files:
        people.print(f"wrote {file}")


def write_json(report: dict[str, Any], file: str) -> None:
    """Write a report to a file, or with ``-`` to standard output.

    Raises:
        InputError: the file cannot be written; names it and the reason.
    """
    text = json.dumps(report, indent=1, allow_nan=False)
    if file == "-":
        print(text)
        return
    try:
        Path(file).write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from error

"""Outputs that cannot be written are refused before any work is done."""

import json
import os
from pathlib import Path
from typing import Any

from rich.console import Console

from ab_sim.errors import InputError

# Results may go to standard output; everything that is only for people goes here.
people = Console(stderr=True, markup=False)


def check_outputs(json_file: str | None, plot: Path | None, *others: Path | None) -> list[Path]:
    """The files that a command will write, after trying them; ``-`` is standard output."""
    json_path = None if json_file in (None, "-") else Path(str(json_file))
    files = [path for path in (json_path, plot, *others) if path is not None]
    for file in files:
        check_writable(file)
    if plot is not None:
        check_picture(plot)
    return files


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


def check_writable(path: Path) -> None:
    """Refuse an output that cannot be written, before any work is done.

    Raises:
        InputError: names the path and what is wrong with it.
    """
    folder = path.parent
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file")
    if not folder.is_dir():
        raise InputError(f"{path}: there is no folder {folder}; make it first")
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise InputError(f"{path}: cannot be written; choose another place or change its rights")


def check_picture(path: Path) -> None:
    """Refuse a picture's file name whose ending says no known format."""
    known = (".png", ".svg", ".pdf")
    if path.suffix.lower() not in known:
        raise InputError(f"--plot {path}: must end in one of {', '.join(known)}")

"""Outputs that cannot be written are refused before any work is done."""

import os
from pathlib import Path

from ab_sim.errors import InputError


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

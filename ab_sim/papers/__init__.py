"""Published papers computed again: their figures and tables, ours beside what is printed.

A paper is a module with a function ``regenerate(folder, tell)`` that writes its pictures into a
folder and returns a ``page.Paper``; ``tell(what, done, total)`` is told how far it is. One line
here adds it to ``ab-sim paper``.
"""

import importlib
from collections.abc import Callable
from pathlib import Path

from ab_sim.errors import InputError, nearest
from ab_sim.papers.page import Paper

PAPERS = {
    "thesis": "ab_sim.papers.thesis",
    "relative-stability": "ab_sim.papers.relative_stability",
    "deck-3d": "ab_sim.papers.deck_3d",
    "three-ball": "ab_sim.papers.three_ball",
}
"""Modules by the papers' short names; imported when they are asked for."""

Tell = Callable[[str, int, int], None]


def regenerate(name: str, folder: Path, tell: Tell) -> Paper:
    """A paper's report; its pictures are written into the folder.

    Args:
        name: one of ``PAPERS``.
        folder: made with the first picture, if it is not there.
        tell: called with what is done now, how much is done, and of how much.

    Raises:
        InputError: there is no such paper; names the known ones and the nearest.
    """
    check_known(name)
    paper: Paper = importlib.import_module(PAPERS[name]).regenerate(folder, tell)
    return paper


def check_known(name: str) -> None:
    """Refuse a name that is none of ``PAPERS``.

    Raises:
        InputError: names the known ones and the nearest.
    """
    if name not in PAPERS:
        raise InputError(
            f"{name!r}: no such paper{nearest(name, PAPERS)}; known are: {', '.join(PAPERS)}"
        )

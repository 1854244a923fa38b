"""Published papers computed again with ab_sim: their figures and tables, ours beside the printed.

A paper is a module with a function ``regenerate(folder, tell)`` that writes its pictures into a
folder and returns a ``page.Paper``; ``tell(what, done, total)`` is told how far it is. One line in
``PAPERS`` adds it to ``ab-sim paper``.
"""

import importlib
from collections.abc import Callable
from pathlib import Path

from ab_sim import InputError
from ab_sim.base.errors import nearest
from gallery.page import Paper

PAPERS = {
    "thesis": "Yoshida 2014: start-ups with a variable-speed period, and a drive that was measured",
    "three-ball": "Lu and Hung 2008: three balls, where they rest and when that is stable",
    "relative-stability": "NSC 2007: how firmly two balls rest, and how they recover",
    "deck-3d": "Kim and Chung 2002: a drive on a deck in space, and its claims put to the test",
    "two-plane": "Rodrigues et al. 2008, 2010: balls in two planes",
}
"""What each is about, by its short name; its module is of that name."""

Tell = Callable[[str, int, int], None]


def regenerate(name: str, folder: Path, tell: Tell) -> Paper:
    """A paper's report; its pictures are written into the folder.

    Parameters
    ----------
    name
        One of ``PAPERS``.
    folder
        Made with the first picture, if it is not there.
    tell
        Called with what is done now, how much is done, and of how much.

    Raises
    ------
    InputError
        There is no such paper; names the known ones and the nearest.
    """
    check_known(name)
    module = importlib.import_module(f"{__name__}.{name.replace('-', '_')}")
    paper: Paper = module.regenerate(folder, tell)
    return paper


def check_known(name: str) -> None:
    """Refuse a name that is none of ``PAPERS``.

    Raises
    ------
    InputError
        Names the known ones and the nearest.
    """
    if name not in PAPERS:
        raise InputError(
            f"{name!r}: no such paper{nearest(name, PAPERS)}; known are: {', '.join(PAPERS)}"
        )

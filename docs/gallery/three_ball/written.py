"""Pictures of the paper's figures, by their numbers."""

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from ab_sim.show.saved import save
from gallery.page import Picture

Tell = Callable[[str, int, int], None]


def written(figure: Figure, folder: Path, number: int, caption: str) -> Picture:
    """Write a figure into the folder."""
    file = f"three-ball-figure-{number}.png"
    save(figure, folder / file, 100)
    return Picture(file, f"Figure {number}: {caption}")

"""The report's three cases, and how pictures show them."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from ab_sim import Scene, load_scene
from ab_sim.show.saved import save
from gallery.page import Picture

SPEED = 900.0
"""[rad/s], after the change of speed."""
PRINTED_MASSES = (0.273e-3, 0.303e-3, 0.333e-3)
"""[kg], Table 1."""
Tell = Callable[[str, int, int], None]


class BallMassCase(NamedTuple):
    """One of the three ball masses."""

    number: int
    scene: Scene
    relation: str
    colour: str

    @property
    def omega_n(self) -> float:
        """sqrt(k/M) [rad/s], of the scene with its balls; the report's Omega is w over it."""
        return own_speed(self.scene)

    @property
    def title(self) -> str:
        """For a panel."""
        return f"({'abc'[self.number - 1]}) {self.relation}"


def own_speed(scene: Scene) -> float:
    """sqrt(k/M) [rad/s]."""
    speed = scene.critical_speed
    assert speed is not None
    return speed


def cases() -> tuple[BallMassCase, ...]:
    """The three, with two balls."""
    marks = (("<", "tab:blue"), ("=", "tab:orange"), (">", "tab:green"))
    return tuple(
        BallMassCase(k, load_scene(f"nsc-case-{k}"), f"2 m R {sign} M2 ε", colour)
        for k, (sign, colour) in enumerate(marks, 1)
    )


def written(figure: Figure, folder: Path, number: int, caption: str) -> Picture:
    """Write a figure of the report's number into the folder."""
    file = f"relative-stability-figure-{number}.png"
    save(figure, folder / file, 100)
    return Picture(file, f"Figure {number}: {caption}")

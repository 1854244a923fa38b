"""The feeding deck of the paper, from the paper's own parameters, and how pictures show it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim import Scene, load_scene
from ab_sim.scene.load import changed_scene
from ab_sim.show.saved import save
from gallery.page import Picture

NAME = "deck-3d"
TRANSLATION, ROTATION = (179.0, 180.0, 181.0), (325.0, 335.0, 347.0)
"""The published natural frequencies [rad/s]."""
SPEEDS = (130.0, *TRANSLATION, *ROTATION, 500.0)
"""At which the paper states what is stable [rad/s]."""
PUBLISHED = {speed: speed > TRANSLATION[-1] for speed in SPEEDS}
"""Whether it says so."""
Tell = Callable[[str, int, int], None]


class DeckParameters(NamedTuple):
    """What the paper varies; the rest is the scene feeding-deck's."""

    c: float = 0.6
    """Damping of a mount [N s/m]."""
    d: float = 0.03
    """From the plate's centre to the spindle [m]."""
    R: float = 0.03
    """Radius of the race [m], and of the disc, whose inertia is M R^2/4 and M R^2/2 (9)."""
    D: float = 1e-5
    """Drag of a ball [N m s/rad]."""
    n: int = 2
    """Balls, with the mass of the paper's two between them."""


def deck_of(p: DeckParameters) -> Scene:
    """The scene with these parameters; balls evenly spread."""
    base = load_scene("feeding-deck")
    assert base.deck is not None and base.rotor.eccentric_mass is not None
    moved = p.d + base.deck.center[1]
    mounts = [
        {
            **mount.model_dump(mode="json"),
            "position": [mount.position[0], mount.position[1] - moved, mount.position[2]],
            "damping": p.c,
        }
        for mount in base.mounts
    ]
    across = 0.25 * base.rotor.eccentric_mass * p.R**2
    changes: dict[str, Any] = {
        "name": NAME,
        "mounts": mounts,
        "deck.center": [0.0, -p.d, 0.0],
        "race.radius": p.R,
        "rotor.inertia": [across, across, 2.0 * across],
        "effects.viscous_drag.coefficient": p.D / p.R**2,
        "balls.count": p.n,
        "balls.mass": base.balls.total_mass / p.n,
        "start.ball_angles": None,
    }
    return changed_scene(base, changes, NAME)


def least_radius() -> float:
    """Of a race in which the paper's two balls can balance the rotor: M eps / (n m) [m]."""
    scene = deck_of(DeckParameters())
    return scene.eccentric_mass * scene.rotor.eccentricity / scene.balls.total_mass


def mark_frequencies(axes: Axes) -> None:
    """The published ones, as lines over the speed."""
    for color, frequencies in (("tab:purple", TRANSLATION), ("tab:brown", ROTATION)):
        for frequency in frequencies:
            axes.axvline(frequency, color=color, lw=0.8, ls=":", zorder=2.5)


def written(figure: Figure, folder: Path, what: str, caption: str) -> Picture:
    """Write a picture into the folder."""
    file = f"{NAME}-{what}.png"
    save(figure, folder / file, 100)
    return Picture(file, caption)

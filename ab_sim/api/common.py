"""What all calls take."""

from collections.abc import Callable
from pathlib import Path

from ab_sim.analysis.held_speed import FASTEST, last_speed
from ab_sim.errors import InputError, exact
from ab_sim.scene import Scene, load_scene

SceneLike = Scene | str | Path
"""A scene, the name of one that comes with the package, or the path of a YAML file."""
Progress = Callable[[str, int, int], None]
"""Called with what is done now, how much is done, and of how much. What it raises ends the work."""


def as_scene(scene: SceneLike) -> Scene:
    """The scene itself, or the one of that name or path.

    Raises:
        SceneError: as of ``load_scene``.
    """
    return scene if isinstance(scene, Scene) else load_scene(scene)


def as_speed(speed: float | None, scene: Scene) -> float:
    """A speed to be held [rad/s]; None: the one that the scene keeps in the end.

    Raises:
        InputError: no number, or too fast.
    """
    if speed is None:
        return last_speed(scene)
    if not abs(speed) <= FASTEST:
        raise InputError(f"speed = {exact(speed)}: must be a number within +-{FASTEST:g} rad/s")
    return float(speed)

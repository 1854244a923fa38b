"""Types and conversions of common arguments."""

from pathlib import Path

from ab_sim.analysis.held_speed import FASTEST, last_speed
from ab_sim.errors import InputError, exact
from ab_sim.scene import Scene, load_scene

SceneLike = Scene | str | Path
"""A scene, the name of one in the package, or the path of a YAML file."""


def as_scene(scene: SceneLike) -> Scene:
    """Return the scene itself, or the one with that name or path.

    Raises:
        SceneError: see ``load_scene``.
    """
    return scene if isinstance(scene, Scene) else load_scene(scene)


def as_speed(speed: float | None, scene: Scene) -> float:
    """Return a constant speed [rad/s]; None: the final speed of the scene.

    Raises:
        InputError: not a number, or too fast.
    """
    if speed is None:
        return last_speed(scene)
    if not abs(speed) <= FASTEST:
        raise InputError(f"speed = {exact(speed)}: must be a number within +-{FASTEST:g} rad/s")
    return float(speed)

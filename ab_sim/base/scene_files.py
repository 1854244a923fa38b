"""Folder and content of scene files; the content is not checked, so that this imports fast."""

from pathlib import Path
from typing import Any

from ab_sim.base.errors import SceneError, nearest
from ab_sim.base.input_file import check_regular
from ab_sim.base.limited_yaml import read_yaml_file
from ab_sim.base.quoting import short

SCENES = Path("config", "scenes")


def scene_folder() -> Path:
    """Return the folder of the scenes that come with ab_sim, in a checkout or installed.

    Raises:
        SceneError: the scenes are not installed.
    """
    here = Path(__file__).resolve()
    checkout = here.parents[2] / SCENES
    # pip and colcon both install to `<prefix>/share/ab_sim`; the package is below the prefix.
    installed = (parent / "share" / "ab_sim" / SCENES for parent in here.parents)
    for folder in (checkout, *installed):
        if folder.is_dir():
            return folder
    raise SceneError("the scenes that come with ab_sim are not installed; reinstall ab_sim")


def scene_names() -> list[str]:
    """Return the names of the scenes that come with the package, sorted.

    Returns
    -------
    list of str
        Names for ``load_scene``.

    Raises
    ------
    SceneError
        The scenes are not installed.

    Examples
    --------
    >>> import ab_sim
    >>> "thesis-hold" in ab_sim.scene_names()
    True
    """
    return sorted(path.stem for path in scene_folder().glob("*.yaml"))


def find_scene(scene: str | Path) -> Path:
    """Return the file of a scene.

    Args:
        scene: name of a scene that comes with ab_sim, or path of a YAML file.

    Raises:
        SceneError: there is no such file or name; the message has the nearest name.
    """
    path = Path(scene)
    if path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        try:
            check_regular(path)
            if path.is_file():
                return path
        except FileNotFoundError as error:
            raise SceneError(f"{path}: no such scene file") from error
        except OSError as error:
            raise SceneError(f"{path}: cannot be read: {error.strerror}") from error
        raise SceneError(f"{path}: is a folder; give the YAML file of a scene")
    names = scene_names()
    if str(scene) in names:
        return scene_folder() / f"{scene}.yaml"
    raise SceneError(
        f"scene {short(str(scene))} is not known{nearest(str(scene), names)}; known are: "
        + ", ".join(names)
        + "; a file is given by its path, ending in .yaml"
    )


def read_scene_file(path: Path) -> dict[str, Any]:
    """Return the content of a scene's file.

    Raises:
        SceneError: the file cannot be read, or is not a mapping.
    """
    try:
        raw = read_yaml_file(path)
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from error
    if not isinstance(raw, dict):
        raise SceneError(f"{path}: must be a mapping of sections (rotor, race, balls, ...)")
    return raw

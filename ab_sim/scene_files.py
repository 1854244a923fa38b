"""Where scenes lie and what their files say, unchecked; takes no time to import, as checks do."""

from pathlib import Path
from typing import Any

from ab_sim.errors import SceneError, nearest
from ab_sim.limited_yaml import read_yaml_file
from ab_sim.quoting import short

SCENES = Path("config", "scenes")


def scene_folder() -> Path:
    """The folder of the scenes that come with the package: a checkout's, or an installed one's."""
    here = Path(__file__).resolve()
    checkout = here.parents[1] / SCENES
    # `<prefix>/share/ab_sim` serves pip and colcon alike: the package lies somewhere below prefix.
    installed = (parent / "share" / "ab_sim" / SCENES for parent in here.parents)
    for folder in (checkout, *installed):
        if folder.is_dir():
            return folder
    raise SceneError("the scenes that come with ab_sim are not installed beside it; reinstall it")


def scene_names() -> list[str]:
    """Names of the scenes that come with the package, sorted.

    Returns
    -------
    list of str
        As ``load_scene`` takes them.

    Raises
    ------
    SceneError
        They are not installed.

    Examples
    --------
    >>> import ab_sim
    >>> "thesis-hold" in ab_sim.scene_names()
    True
    """
    return sorted(path.stem for path in scene_folder().glob("*.yaml"))


def find_scene(scene: str | Path) -> Path:
    """The file of a scene given by name (``thesis-hold``) or by path.

    Raises:
        SceneError: neither a file nor a known name; names the nearest known one.
    """
    path = Path(scene)
    if path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        try:
            if path.is_file():
                return path
            is_folder = path.is_dir()
        except OSError as error:
            raise SceneError(f"{path}: cannot be read: {error.strerror}") from error
        what = "is a folder; give the YAML file of a scene" if is_folder else "no such scene file"
        raise SceneError(f"{path}: {what}")
    names = scene_names()
    if str(scene) in names:
        return scene_folder() / f"{scene}.yaml"
    raise SceneError(
        f"scene {short(str(scene))} is not known{nearest(str(scene), names)}; known are: "
        + ", ".join(names)
        + "; a file is given by its path, ending in .yaml"
    )


def read_scene_file(path: Path) -> dict[str, Any]:
    """What a scene's file says.

    Raises:
        SceneError: it cannot be read, or is no mapping.
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

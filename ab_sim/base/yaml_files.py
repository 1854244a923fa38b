"""YAML from users, read with limits; folder and content of scene files, which are not checked here.

A few hundred bytes with nested aliases can expand to billions of values. So the values that aliases
refer to are counted while a text is read, and reading stops at a limit. This module imports fast.
"""

import copy
import functools
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from ab_sim.base.errors import SceneError, nearest, short, shortened
from ab_sim.base.files import check_regular

MOST_BYTES = 1 << 18
"""Largest size of a text; a profile with the largest number of segments takes half of it."""
MOST_VALUES = 50_000
"""Largest number of keys, values and collections; those of an alias count at each use."""
MOST_LEVELS = 30
"""Largest nesting of collections."""
_MOST_DIGITS = 100
"""Largest number of characters of a number."""

_LEADING_ZERO = re.compile(r"[-+]?0[0-9_]+")
_MADE_OF_BAD_VALUES = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""Errors that PyYAML raises for a value that does not match its tag, as in ``!!int ""``."""


class _TooMuch(yaml.YAMLError):
    """Error: a text exceeds a limit of this module."""


class _Limited(yaml.SafeLoader):
    """YAML loader with limits; a repeated key is an error, and does not replace the first one."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._levels = self._values = 0
        self._sizes: dict[yaml.Node, int] = {}

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Count a node or an alias and compose it; SafeLoader calls this for each of them."""
        event: yaml.Event = self.peek_event()  # type: ignore[no-untyped-call]
        alias = event.anchor if isinstance(event, yaml.AliasEvent) else None
        before: int = self._values
        self._values += 1
        self._levels += 1
        if self._levels > MOST_LEVELS:
            raise _TooMuch(f"has more than {MOST_LEVELS} levels within each other{_at(event)}")
        node: Any = super().compose_node(parent, index)
        self._levels -= 1
        if alias is None:
            self._sizes[node] = self._values - before
        elif node not in self._sizes:
            raise yaml.YAMLError(f"*{alias} refers to a node that contains it{_at(event)}")
        else:
            self._values = before + self._sizes[node]
        if self._values > MOST_VALUES:
            raise _TooMuch(f"has more than {MOST_VALUES} values{_at(event)}")
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Construct a mapping as SafeLoader does, but refuse repeated keys."""
        seen = set()
        for key in (self.construct_object(key_node, deep=True) for key_node, _ in node.value):
            if key in seen:
                line = node.start_mark.line + 1
                raise yaml.YAMLError(
                    f"key {short(key)} is given twice in the mapping at line {line}"
                )
            seen.add(key)
        return super().construct_mapping(node, deep=deep)

    def construct_number(self, node: yaml.ScalarNode) -> float:
        """Return the number of a YAML node as a reader expects it: 010 is 10, and 1:30 is refused.

        By YAML 1.1, which SafeLoader implements, these numbers are 8 and 90.
        """
        if len(node.value) > _MOST_DIGITS:
            raise _TooMuch(f"has a number of more than {_MOST_DIGITS} digits{_at(node)}")
        if ":" in node.value:
            raise yaml.YAMLError(
                f"{node.value} would be a number in base 60; write it with a decimal point, or as "
                f"text in quotes{_at(node)}"
            )
        whole = node.tag.endswith(":int")
        if whole and _LEADING_ZERO.fullmatch(node.value):
            return int(node.value.replace("_", ""))
        return self.construct_yaml_int(node) if whole else self.construct_yaml_float(node)


for _kind in ("int", "float"):
    _Limited.add_constructor(f"tag:yaml.org,2002:{_kind}", _Limited.construct_number)


def read_yaml(text: str) -> Any:
    """Return the content of a YAML text.

    Raises
    ------
    ValueError
        The text is not YAML, or exceeds a limit; the message has no subject, and the caller puts
        the text's name in front of it.
    """
    if len(text.encode(errors="replace")) > MOST_BYTES:
        raise ValueError(f"has more than {MOST_BYTES} bytes; write it shorter")
    try:
        return copy.deepcopy(_parsed(text))
    except _TooMuch as error:
        raise ValueError(f"{error}; write it shorter") from error
    except (yaml.YAMLError, *_MADE_OF_BAD_VALUES) as error:
        raise ValueError(f"is not valid YAML: {_in_a_line(error)}") from error


@functools.lru_cache(maxsize=32)
def _parsed(text: str) -> Any:
    """Return the content of a YAML text; to parse a scene takes longer than to check it."""
    return yaml.load(text, Loader=_Limited)


def yaml_text(content: Mapping[str, Any]) -> str:
    """Return a mapping of plain values as YAML, with its keys in their order."""
    return yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True)


def read_yaml_file(path: Path) -> Any:
    """Return the content of a YAML file.

    Raises
    ------
    ValueError
        See ``read_yaml``.
    OSError
        The file cannot be read.
    """
    check_regular(path)
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"has more than {MOST_BYTES} bytes; write it shorter")
    try:
        text = content.decode()
    except UnicodeDecodeError as error:
        raise ValueError(f"is not valid YAML: {error}") from error
    return read_yaml(text)


def _in_a_line(error: Exception) -> str:
    """Return an error of PyYAML as one line, with its position if it has one."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem:
        return shortened(error.problem) + (_at(error.problem_mark) if error.problem_mark else "")
    text = shortened(" ".join(str(error).split()))
    return text if isinstance(error, yaml.YAMLError) else f"a value is not of its kind ({text})"


def _at(place: Any) -> str:
    mark = getattr(place, "start_mark", place)
    return f", at line {mark.line + 1}, column {mark.column + 1}"


_SCENES = Path("config", "scenes")
"""Folder of the scenes, relative to a checkout or to ``share/ab_sim``."""


def _scene_folder() -> Path:
    """Return the folder of the scenes that come with ab_sim, in a checkout or installed.

    Raises
    ------
    SceneError
        The scenes are not installed.
    """
    here = Path(__file__).resolve()
    checkout = here.parents[2] / _SCENES
    # pip and colcon both install to `<prefix>/share/ab_sim`; the package is below the prefix.
    installed = (parent / "share" / "ab_sim" / _SCENES for parent in here.parents)
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
    return sorted(path.stem for path in _scene_folder().glob("*.yaml"))


def find_scene(scene: str | Path) -> Path:
    """Return the file of a scene.

    Parameters
    ----------
    scene
        Name of a scene that comes with ab_sim, or path of a YAML file.

    Raises
    ------
    SceneError
        There is no such file or name; the message has the nearest name.
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
        return _scene_folder() / f"{scene}.yaml"
    raise SceneError(
        f"scene {short(str(scene))} is not known{nearest(str(scene), names)}; known are: "
        + ", ".join(names)
        + "; a file is given by its path, ending in .yaml"
    )


def read_scene_file(path: Path) -> dict[str, Any]:
    """Return the content of a scene's file.

    Raises
    ------
    SceneError
        The file cannot be read, or is not a mapping.
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

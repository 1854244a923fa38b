"""Find a scene by name or file, read it, apply ``key=value`` changes, check it."""

import contextlib
import copy
import functools
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from ab_sim.errors import SceneError, nearest
from ab_sim.scene.explain import explain
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes

SCENES = Path("config", "scenes")


def scene_folder() -> Path:
    """The folder of the scenes that come with the package: a checkout's, or an installed one's."""
    here = Path(__file__).resolve()
    checkout = here.parents[2] / SCENES
    # `<prefix>/share/ab_sim` serves pip and colcon alike: the package lies somewhere below prefix.
    installed = (parent / "share" / "ab_sim" / SCENES for parent in here.parents)
    for folder in (checkout, *installed):
        if folder.is_dir():
            return folder
    raise SceneError("the scenes that come with ab_sim are not installed beside it; reinstall it")


def scene_names() -> list[str]:
    """Names of the scenes that come with the package, sorted."""
    return sorted(path.stem for path in scene_folder().glob("*.yaml"))


def find_scene(scene: str | Path) -> Path:
    """The file of a scene given by name (``thesis-hold``) or by path.

    Raises:
        SceneError: neither a file nor a known name; names the nearest known one.
    """
    path = Path(scene)
    if path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        if path.is_file():
            return path
        raise SceneError(f"{path}: no such scene file")
    names = scene_names()
    if str(scene) in names:
        return scene_folder() / f"{scene}.yaml"
    raise SceneError(
        f"scene {str(scene)!r} is not known{nearest(str(scene), names)}; known are: "
        + ", ".join(names)
        + "; a file is given by its path, ending in .yaml"
    )


def load_scene(scene: str | Path, changes: Iterable[str] = ()) -> Scene:
    """Read and check a scene.

    Args:
        scene: name of a scene that comes with the package, or path of a YAML file.
        changes: ``key=value`` with a dotted key, e.g. ``balls.mass=0.002`` or
            ``effects.viscous_drag.coefficient=2``; the value is read as YAML; an empty value
            removes the key, which has to be there. A change that asks for an ``accuracy`` takes
            the file's ``solver`` away, which it stands instead of, and the other way round.

    Raises:
        SceneError: names file, key, value, what is allowed, and the nearest known name.
    """
    path = find_scene(scene)
    raw = _read(path)
    _change(raw, [_parsed(change) for change in changes])
    raw.setdefault("name", path.stem)
    return check_scene(raw, origin=str(path))


def changed_scene(scene: Scene, changes: Mapping[str, Any], origin: str) -> Scene:
    """The scene with other values.

    Args:
        scene: stays as it is.
        changes: values by dotted key, e.g. ``{"balls.mass": 0.002}``; None removes the key, which
            has to be there.
        origin: what to call the changes in messages.

    Raises:
        SceneError: a key is not a text, there is nothing to remove, or what comes out is not a
            valid scene.
    """
    if not isinstance(changes, Mapping) or not all(isinstance(key, str) for key in changes):
        raise SceneError(
            f"{origin} = {changes!r}: must be a mapping of dotted keys to values, e.g. "
            "{'balls.mass': 0.002}"
        )
    raw = copy.deepcopy(scene.as_mapping())
    _change(
        raw,
        [
            _Change(key, _REMOVED if value is None else value, f"{origin}: {key}")
            for key, value in changes.items()
        ],
    )
    return check_scene(raw, origin)


def with_solver(scene: Scene, stepper: str, step: float) -> Scene:
    """The scene with this solver, and no wish.

    Raises:
        SceneError: it does not take that step.
    """
    raw = {key: value for key, value in scene.as_mapping().items() if key != "accuracy"}
    raw["solver"] = {"stepper": stepper, "step": round(step, 12)}
    return check_scene(raw, scene.name)


def check_scene(raw: Mapping[str, Any], origin: str) -> Scene:
    """A scene out of nested mappings; ``origin`` names their source in messages."""
    sections = dict(raw)
    problems: list[str] = []
    effects: dict[str, Any] = {}
    try:
        if "effects" not in sections:
            raise ValueError("effects: is missing; add it, if empty as []")
        named = _effects_model().model_validate(_by_name(sections["effects"]))
        effects = {name: getattr(named, name) for name in named.model_fields_set}
        effects = {name: effects[name] for name in effect_classes() if name in effects}
    except ValidationError as error:
        problems += explain(error, ("effects",))
    except ValueError as error:
        problems.append(str(error))
    try:
        checked = Scene.model_validate({**sections, "effects": effects})
    except ValidationError as error:
        problems += explain(error, (), only_own_fields=bool(problems))
    if problems:
        raise SceneError("\n".join(f"{origin}: {problem}" for problem in problems))
    return checked


@functools.cache
def _effects_model() -> type[BaseModel]:
    fields: dict[str, Any] = {name: (effect, None) for name, effect in effect_classes().items()}
    return create_model("Effects", __config__=ConfigDict(extra="forbid"), **fields)


def _by_name(effects: Any) -> dict[str, Any]:
    """`effects:` is a list of names, each bare or with its parameters; a mapping serves too.

    Raises:
        ValueError: it is neither; says what is wrong with it.
    """
    if isinstance(effects, Mapping):
        entries = list(effects.items())
    elif isinstance(effects, list):
        entries = []
        for entry in effects:
            if isinstance(entry, str):
                entries.append((entry, {}))
            elif isinstance(entry, Mapping) and len(entry) == 1:
                entries.extend(entry.items())
            else:
                raise ValueError(
                    f"effects: {entry!r} is not an effect; write a name, or "
                    "`name: {parameter: value}`"
                )
    else:
        raise ValueError(
            f"effects = {effects!r}: must be a list of names, each with its parameters "
            "(`ab-sim effects` prints them); an empty list is []"
        )
    mapping: dict[str, Any] = {}
    for name, parameters in entries:
        if name in mapping:
            raise ValueError(f"effects: {name} is named twice; keep one")
        if not isinstance(parameters, Mapping | None):
            raise ValueError(
                f"effects.{name} = {parameters!r}: must be its parameters, `parameter: value`"
            )
        mapping[str(name)] = parameters or {}
    return mapping


class _UniqueKeys(yaml.SafeLoader):
    """YAML in which a key given twice is an error instead of silently winning."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [self.construct_object(key, deep=deep) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                line = node.start_mark.line + 1
                raise yaml.YAMLError(f"key {key!r} is given twice in the mapping at line {line}")
        return super().construct_mapping(node, deep=deep)


def _read(path: Path) -> dict[str, Any]:
    try:
        raw = yaml.load(path.read_text(encoding="utf-8"), Loader=_UniqueKeys)
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SceneError(f"{path}: is not valid YAML: {error}") from error
    if not isinstance(raw, dict):
        raise SceneError(f"{path}: must be a mapping of sections (rotor, race, balls, ...)")
    # By name, so that changes can reach them; what cannot be read so is told with the rest.
    with contextlib.suppress(ValueError, KeyError):
        raw["effects"] = _by_name(raw["effects"])
    return raw


_REMOVED: Any = object()


class _Change(NamedTuple):
    """A value for a dotted key, or ``_REMOVED``."""

    key: str
    value: Any
    said: str
    """What to call it in messages."""


def _parsed(change: str) -> _Change:
    key, equals, text = change.partition("=")
    said = f"change {change!r}"
    if not equals or not all(part.strip() for part in key.split(".")):
        raise SceneError(f"{said}: must be key=value, e.g. balls.mass=0.002")
    try:
        value = yaml.load(text, Loader=_UniqueKeys)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise SceneError(f"{said}: the value is not valid YAML: {error}") from error
    return _Change(key.strip(), _REMOVED if text.strip() == "" else value, said)


def _change(raw: dict[str, Any], changes: Sequence[_Change]) -> None:
    for change in changes:
        if change.value is _REMOVED:
            _remove(raw, change)
        else:
            _set(raw, change)
    # Who changes the accuracy does not want the file's solver any more, and vice versa; who
    # changes both is told that they exclude each other, when the scene is checked.
    given = {change.key.partition(".")[0] for change in changes if change.value is not _REMOVED}
    for wanted, other in (("accuracy", "solver"), ("solver", "accuracy")):
        if wanted in given and other not in given:
            raw.pop(other, None)


def _set(raw: dict[str, Any], change: _Change) -> None:
    *sections, last = change.key.split(".")
    here = raw
    for section in sections:
        if here.get(section) is None:
            here[section] = {}
        here = _inside(here, section, change)
    here[last] = change.value


def _remove(raw: dict[str, Any], change: _Change) -> None:
    *sections, last = change.key.split(".")
    here, owner = raw, "the scene"
    for section in sections:
        _check_there(here, section, owner, change)
        here, owner = _inside(here, section, change), section
    _check_there(here, last, owner, change)
    del here[last]


def _check_there(here: dict[str, Any], key: str, owner: str, change: _Change) -> None:
    """What is not there may be a slip of the pen for what is, which would silently stay."""
    if key not in here:
        there = [str(other) for other in here]
        raise SceneError(
            f"{change.said}: {owner} has no {key!r} to remove{nearest(key, there)}; it has "
            + (", ".join(there) or "no keys")
        )


def _inside(here: dict[str, Any], section: str, change: _Change) -> dict[str, Any]:
    inner = here[section]
    if not isinstance(inner, dict):
        raise SceneError(f"{change.said}: {section} is a value, it has no keys")
    return inner

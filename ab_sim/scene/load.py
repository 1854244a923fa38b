"""Read a scene or a speed profile, apply ``key=value`` changes, check it."""

import contextlib
import functools
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, create_model

from ab_sim.base.errors import SceneError, short
from ab_sim.base.yaml_files import find_scene, read_scene_file, read_yaml
from ab_sim.scene.changes import REMOVED, Change, all_parsed, apply
from ab_sim.scene.explain import explain
from ab_sim.scene.keys import without_units
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import AnyProfile, Profile, check_profile
from ab_sim.scene.registry import effect_classes

SceneLike = Scene | str | Path
"""A scene, the name of one in the package, or the path of a YAML file."""


def load_scene(scene: str | Path, changes: Iterable[str] = ()) -> Scene:
    """Read and check a scene.

    Parameters
    ----------
    scene : str or Path
        Name of a scene that comes with the package, or path of a YAML file.
    changes : iterable of str, optional
        ``key=value`` with a dotted key, e.g. ``balls.mass=0.002`` or
        ``effects.viscous_drag.coefficient=2``. The value is read as YAML. Numbers are in SI or have
        a unit: ``balls.mass=2 g``. An empty value removes the key, which must exist. A change of
        ``accuracy`` removes the file's ``solver``, because one replaces the other, and vice versa.

    Returns
    -------
    Scene
        The checked, immutable scene.

    Raises
    ------
    SceneError
        The scene is invalid; the message names file, key, value, allowed values, and the nearest
        known name.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["balls.mass=0.002"])
    >>> scene.balls.masses, scene.critical_speed
    ((0.002, 0.002), 100.0)
    >>> ab_sim.load_scene("thesis-hold", ["balls.mass=2 g", "start.speed=60 rpm"]).balls.mass
    0.002
    >>> ab_sim.load_scene("thesis-hold", ["balls.mas=0.002"])
    Traceback (most recent call last):
    ab_sim.base.errors.SceneError: ...balls.mas...
    """
    path = find_scene(scene)
    raw = read_mapping(path)
    apply(raw, all_parsed(changes))
    raw.setdefault("name", path.stem)
    return check_scene(raw, origin=str(path))


def as_scene(scene: SceneLike) -> Scene:
    """Return a scene unchanged; load the scene that a name or path states.

    Raises
    ------
    SceneError
        See ``load_scene``.
    """
    return scene if isinstance(scene, Scene) else load_scene(scene)


def changed_scene(scene: Scene, changes: Mapping[str, Any], origin: str) -> Scene:
    """Return a copy of a scene with some values changed.

    Parameters
    ----------
    scene
        Original scene; it does not change.
    changes
        Values by dotted key, SI or a text with a unit, e.g. ``{"balls.mass": 0.002}`` or ``"2 g"``;
        None removes the key, which must exist.
    origin
        Name of the changes in messages.

    Raises
    ------
    SceneError
        A key is not a text, there is nothing to remove, or the result is not a valid scene.
    """
    if not isinstance(changes, Mapping) or not all(isinstance(key, str) for key in changes):
        raise SceneError(
            f"{origin} = {short(changes)}: must be a mapping of dotted keys to values, e.g. "
            "{'balls.mass': 0.002}"
        )
    # Sections without changes are already checked and are passed on as objects. Conditions between
    # sections are checked again for the whole scene.
    touched = {key.partition(".")[0] for key in changes}
    raw = scene.with_plain(touched)
    apply(
        raw,
        [
            Change(key, REMOVED if value is None else value, f"{origin}: {key}")
            for key, value in changes.items()
        ],
    )
    if "effects" in touched:
        return check_scene(raw, origin)
    return _checked(raw, scene.effects, [], origin)


def with_solver(
    scene: Scene, stepper: str, step: float, parameters: Mapping[str, float] | None = None
) -> Scene:
    """Return a copy of a scene with another solver and without a requested accuracy.

    Parameters
    ----------
    scene
        Original scene; it does not change.
    stepper
        Name of the stepper.
    step
        Integration step [s], rounded to 1e-12 s.
    parameters
        Parameters of the stepper by name, in the units of the stepper; None for none.

    Raises
    ------
    SceneError
        The stepper or step is not allowed.
    """
    raw = {key: value for key, value in scene.as_mapping().items() if key != "accuracy"}
    raw["solver"] = {"stepper": stepper, "step": round(step, 12), "parameters": parameters or {}}
    return check_scene(raw, scene.name)


def check_scene(raw: Mapping[str, Any], origin: str) -> Scene:
    """Check the content of a scene's file and return the scene.

    Parameters
    ----------
    raw
        Nested mappings; numbers are in SI or texts with a unit.
    origin
        Name of the source of the content, for messages.

    Raises
    ------
    SceneError
        See ``load_scene``.
    """
    problems: list[str] = []
    effects: dict[str, Any] = {}
    try:
        if "effects" not in raw:
            raise ValueError("effects: is missing; add it, if empty as []")
        model = _effects_model(tuple(effect_classes().items()))
        effects_ = without_units(_by_name(raw["effects"]), ("effects",))
        named = model.model_validate(effects_)
        effects = {name: getattr(named, name) for name in named.model_fields_set}
        effects = {name: effects[name] for name in effect_classes() if name in effects}
    except ValidationError as error:
        problems += explain(error, ("effects",))
    except ValueError as error:
        problems.append(str(error))
    return _checked(raw, effects, problems, origin)


def _checked(
    raw: Mapping[str, Any], effects: Mapping[str, Any], problems: Sequence[str], origin: str
) -> Scene:
    """Check all sections except effects, and return the scene; report all problems together."""
    try:
        checked = Scene.model_validate({**without_units(dict(raw)), "effects": effects})
    except ValidationError as error:
        problems = [*problems, *explain(error, (), only_own_fields=bool(problems))]
    if problems:
        raise SceneError("\n".join(f"{origin}: {problem}" for problem in problems))
    return checked


@functools.lru_cache(maxsize=8)
def _effects_model(classes: tuple[tuple[str, type], ...]) -> type[BaseModel]:
    """Return the pydantic model of effects by name; a new one after each new registration."""
    fields: dict[str, Any] = {name: (effect, None) for name, effect in classes}
    return create_model("Effects", __config__=ConfigDict(extra="forbid"), **fields)


def _by_name(effects: Any) -> dict[str, Any]:
    """Return effects by name from a list of names, each bare or with parameters, or from a mapping.

    Raises
    ------
    ValueError
        The value is neither; the message states the problem.
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
                    f"effects: {short(entry)} is not an effect; write a name, or "
                    "`name: {parameter: value}`"
                )
    else:
        raise ValueError(
            f"effects = {short(effects)}: must be a list of names, each with its parameters "
            "(`ab-sim effects` prints them); an empty list is []"
        )
    mapping: dict[str, Any] = {}
    for name, parameters in entries:
        if name in mapping:
            raise ValueError(f"effects: {name} is named twice; keep one")
        if not isinstance(parameters, Mapping | None):
            raise ValueError(
                f"effects.{name} = {short(parameters)}: must be its parameters, `parameter: value`"
            )
        mapping[str(name)] = parameters or {}
    return mapping


def read_mapping(path: Path) -> dict[str, Any]:
    """Return the unchecked content of a scene's file, with effects by name.

    Raises
    ------
    SceneError
        The file cannot be read, or is not a mapping.
    """
    raw = read_scene_file(path)
    # Effects by name, so that keys of changes can refer to them. Unreadable effects stay as they
    # are: the check of the scene reports them together with all other errors.
    with contextlib.suppress(ValueError, KeyError):
        raw["effects"] = _by_name(raw["effects"])
    return raw


GIVEN = "the profile in braces"
"""Name in messages of a profile that is passed as text."""
_INF = float("inf")


class RequestedProfile(NamedTuple):
    """A requested profile and the speed at which it begins."""

    profile: AnyProfile
    first: float
    """Speed at which the profile begins [rad/s]."""
    scene: Scene | None = None
    """Scene that contains the profile; None if the profile was given without a scene."""


def load_profile(source: str, changes: Iterable[str] = ()) -> RequestedProfile:
    """Read and check a profile.

    Parameters
    ----------
    source
        Name or YAML file of a scene with a profile; or a YAML file with the content of a scene's
        ``profile``, which then begins at standstill; or that content itself, in braces.
    changes
        ``key=value`` with a dotted key, such as ``profile.target_speed=150``; for a scene also
        other keys.

    Raises
    ------
    SceneError
        There is no profile, or it is invalid; the message names key, value and allowed range.
    """
    if source.lstrip().startswith("{"):
        return _alone(_mapping(source), changes, GIVEN)
    path = find_scene(source)
    raw = read_mapping(path)
    if "kind" in raw:
        return _alone(raw, changes, str(path))
    scene = load_scene(source, changes)
    if scene.profile is None:
        raise SceneError(
            f"{path}: this scene has no profile to run; add one, or name another scene"
        )
    return RequestedProfile(scene.profile, scene.start.speed, scene)


def _alone(raw: dict[str, Any], changes: Iterable[str], origin: str) -> RequestedProfile:
    """Return a profile that has no scene, after applying changes and checks.

    Raises
    ------
    SceneError
        The profile is invalid, or a change is for another section of a scene.
    """
    whole = {"profile": raw}
    apply(whole, all_parsed(changes))
    if others := whole.keys() - {"profile"}:
        raise SceneError(
            f"{origin}: is a profile by itself, and a change is for {', '.join(sorted(others))}; "
            "keys begin with profile., e.g. profile.target_speed=150"
        )
    try:
        profile: AnyProfile = TypeAdapter(Profile).validate_python(
            without_units(whole).get("profile")
        )
        check_profile(profile, 0.0, _INF, _INF)
    except ValidationError as error:
        raise SceneError(
            "\n".join(f"{origin}: {problem}" for problem in explain(error, ("profile",)))
        ) from error
    except ValueError as error:
        raise SceneError(f"{origin}: {error}") from error
    return RequestedProfile(profile, 0.0)


def _mapping(text: str) -> dict[str, Any]:
    """Return the content of a profile in braces; it must be a mapping."""
    try:
        raw = read_yaml(text)
    except ValueError as error:
        raise SceneError(f"{GIVEN} {error}") from error
    if not isinstance(raw, dict):
        raise SceneError(f"{GIVEN} must be one mapping, e.g. {{kind: segments, segments: [...]}}")
    return raw

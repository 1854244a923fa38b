"""Read a speed profile, from a scene or by itself, for a node that commands a drive."""

from collections.abc import Iterable
from typing import Any, NamedTuple

from pydantic import TypeAdapter, ValidationError

from ab_sim.base.errors import SceneError
from ab_sim.base.limited_yaml import read_yaml
from ab_sim.base.scene_files import find_scene
from ab_sim.scene.changes import all_parsed, apply
from ab_sim.scene.explain import explain
from ab_sim.scene.load import load_scene, read_mapping
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import AnyProfile, Profile, check_profile
from ab_sim.scene.unit_texts import without_units

GIVEN = "the profile in braces"
INF = float("inf")


class RequestedProfile(NamedTuple):
    """A requested profile and the speed at which it begins."""

    profile: AnyProfile
    first: float
    """Speed at which the profile begins [rad/s]."""
    scene: Scene | None = None
    """Scene that contains the profile; None if the profile was given without a scene."""


def load_profile(source: str, changes: Iterable[str] = ()) -> RequestedProfile:
    """Read and check a profile.

    Args:
        source: name or YAML file of a scene with a profile; or a YAML file with the content of a
            scene's ``profile``, which then begins at standstill; or that content itself, in braces.
        changes: ``key=value`` with a dotted key, such as ``profile.target_speed=150``; for a scene
            also other keys.

    Raises:
        SceneError: there is no profile, or it is invalid; the message names key, value and allowed
            range.
    """
    if source.lstrip().startswith("{"):
        return _alone(_mapping(source), changes, GIVEN)
    path = find_scene(source)
    raw = read_mapping(path)
    if "kind" in raw:
        return _alone(raw, changes, str(path))
    scene = load_scene(source, changes)
    if scene.profile is None:
        raise SceneError(f"{path}: this scene has no profile to run; add one, or name another")
    return RequestedProfile(scene.profile, scene.start.speed, scene)


def _alone(raw: dict[str, Any], changes: Iterable[str], origin: str) -> RequestedProfile:
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
        check_profile(profile, 0.0, INF, INF)
    except ValidationError as error:
        raise SceneError(
            "\n".join(f"{origin}: {problem}" for problem in explain(error, ("profile",)))
        ) from error
    except ValueError as error:
        raise SceneError(f"{origin}: {error}") from error
    return RequestedProfile(profile, 0.0)


def _mapping(text: str) -> dict[str, Any]:
    try:
        raw = read_yaml(text)
    except ValueError as error:
        raise SceneError(f"{GIVEN} {error}") from error
    if not isinstance(raw, dict):
        raise SceneError(f"{GIVEN} must be one mapping, e.g. {{kind: segments, segments: [...]}}")
    return raw

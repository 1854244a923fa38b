"""Changes to the content of a scene's file, each ``key=value`` with a dotted key."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from ab_sim.base.errors import SceneError, nearest, short
from ab_sim.base.yaml_files import read_yaml
from ab_sim.scene.sections import MAX_BALLS

REMOVED: Any = object()
"""Marker for the value of a removed key."""


AXES = 3
"""Number of values of a mount's stiffness or damping, one per axis."""
ZERO = {"start.ball_rates": 0.0, "race.height": 0.0, "balls.race": 0}
"""Keys that take a list, or one number for all entries; the default of each key."""
_NAMED = ("sensors", "probes")
"""Sections whose keys are names chosen by users, so that a key of digits is no list index."""


class Change(NamedTuple):
    """A value for a dotted key, or ``REMOVED``."""

    key: str
    value: Any
    origin: str
    """Name of the change in messages."""


def all_parsed(changes: Iterable[str]) -> list[Change]:
    """Parse changes of the form ``key=value``, with the value in YAML.

    An empty value removes the key.

    Raises
    ------
    SceneError
        A change has another form, or the changes are not a list of texts.
    """
    texts = list(changes)
    if isinstance(changes, str | Mapping) or not all(isinstance(text, str) for text in texts):
        raise SceneError(
            f"changes = {short(changes)}: must be a list of texts, e.g. ['balls.mass=0.002']"
        )
    return [_parsed(change) for change in texts]


def _parsed(change: str) -> Change:
    key, equals, text = change.partition("=")
    origin = f"change {short(change)}"
    if not equals or not all(part.strip() for part in key.split(".")):
        raise SceneError(f"{origin}: must be key=value, e.g. balls.mass=0.002")
    try:
        value = read_yaml(text)
    except ValueError as error:
        raise SceneError(f"{origin}: the value {error}") from error
    return Change(key.strip(), REMOVED if text.strip() == "" else value, origin)


def apply(raw: dict[str, Any], changes: Sequence[Change]) -> None:
    """Apply changes in place to nested mappings; inner mappings are copied before they change.

    A key refers to an entry of a list by its index, counted from 0: ``balls.mass.1``. If the scene
    gives one number for all entries, the change replaces it with a list.

    Raises
    ------
    SceneError
        A key to remove is missing, a list has no such entry, or a key refers to a part of a single
        value.
    """
    balls = _balls(raw)
    for change in changes:
        if change.key == "balls":
            balls = _balls({"balls": change.value})
        elif change.key == "balls.count":
            balls = _balls({"balls": {"count": change.value}})
    for change in changes:
        if change.value is REMOVED:
            _remove(raw, change, balls)
        else:
            _set(raw, change, balls)
    # A new accuracy replaces the file's solver, and vice versa. If both are changed, the check of
    # the scene reports that they exclude each other.
    keys = {change.key.partition(".")[0] for change in changes if change.value is not REMOVED}
    for wanted, other in (("accuracy", "solver"), ("solver", "accuracy")):
        if wanted in keys and other not in keys:
            raw.pop(other, None)


def value_at(raw: Mapping[str, Any], key: str) -> Any:
    """Return the value at a dotted key of a scene's plain values; None if there is none.

    Raises
    ------
    SceneError
        A list has no such entry; the message names its entries.
    """
    here: Any = raw
    path = ""
    for part in key.split("."):
        here = _listed(path, here, _balls(raw))
        if isinstance(here, list):
            here = here[_place(here, part, path, key)]
        else:
            here = here.get(part) if isinstance(here, dict) else None
        path = _joined(path, part)
    return here


def _listed(path: str, value: Any, balls: int) -> Any:
    """Expand one number that stands for all entries to a list; return other values unchanged.

    Parameters
    ----------
    path
        Dotted key of the value.
    value
        Value in the scene, numbers also as texts; None if it is missing.
    balls
        Number of balls, the length of lists with one entry per ball.
    """
    if value is None and path in ZERO:
        value = ZERO[path]
    if isinstance(value, bool) or not isinstance(value, float | int | str):
        return value
    if path in ("balls.mass", "balls.radius", "balls.race", "start.ball_rates"):
        return [value] * balls
    if path == "race.height":
        return [value]
    if path.startswith("mounts.") and path.endswith((".stiffness", ".damping")):
        return [value] * AXES
    return value


def _balls(raw: Mapping[str, Any]) -> int:
    """Return the number of balls of an unchecked scene; 0 if it is missing or invalid."""
    balls = raw.get("balls")
    if not isinstance(balls, Mapping):
        return getattr(balls, "count", 0)
    count = balls.get("count")
    return count if type(count) is int and 0 <= count <= MAX_BALLS else 0


def _set(raw: dict[str, Any], change: Change, balls: int) -> None:
    here, owner, last = _owner(raw, change, balls, create=True)
    here[_place(here, last, owner, change.origin) if isinstance(here, list) else last] = (
        change.value
    )


def _remove(raw: dict[str, Any], change: Change, balls: int) -> None:
    here, owner, last = _owner(raw, change, balls, create=False)
    if isinstance(here, list):
        del here[_place(here, last, owner, change.origin)]
    else:
        _check_there(here, last, owner, change)
        del here[last]


def _owner(
    raw: dict[str, Any], change: Change, balls: int, *, create: bool
) -> tuple[Any, str, str]:
    """Copy the section or list that contains a changed key, and all that contain this one.

    Parameters
    ----------
    raw
        The scene, changed in place.
    change
        Change whose key is looked up.
    balls
        Number of balls.
    create
        True to add missing sections; False to refuse them.

    Returns
    -------
    tuple[Any, str, str]
        The copied section or list, its dotted key, and the last part of the changed key.
    """
    parts = change.key.split(".")
    here: Any = raw
    path = ""
    for section, following in pairwise(parts):
        place: Any = section
        if isinstance(here, list):
            place = _place(here, section, path, change.origin)
        elif not create:
            _check_there(here, section, path, change)
        path = _joined(path, section)
        inner = here[place] if isinstance(here, list) else here.get(place)
        if create:
            inner = _listed(path, inner, balls)
        if inner is None and create:
            if following.isdecimal() and path not in _NAMED:
                raise SceneError(
                    f"{change.origin}: the scene gives no {path}; give the whole list, {path}=[...]"
                )
            inner = {}
        if not isinstance(inner, dict | list | tuple):
            raise SceneError(f"{change.origin}: {path} is a value, it has no keys")
        here[place] = dict(inner) if isinstance(inner, dict) else list(inner)
        here = here[place]
    return here, path, parts[-1]


def _joined(path: str, part: str) -> str:
    return f"{path}.{part}" if path else part


def _place(entries: Sequence[Any], part: str, path: str, origin: str) -> int:
    """Return the index that a part of a key stands for.

    Raises
    ------
    SceneError
        The list has no such entry; the message names its entries.
    """
    if part.isascii() and part.isdecimal() and len(part) < 10 and int(part) < len(entries):
        return int(part)
    count = len(entries)
    there = f"has {count} entries, {path}.0 to {path}.{count - 1}" if count else "has no entries"
    raise SceneError(
        f"{origin}: {path} {there}, and no {short(part)}; name one of them, or give the whole "
        f"list, {path}=[...]"
    )


def _check_there(here: Mapping[str, Any], key: str, owner: str, change: Change) -> None:
    """Refuse to remove a missing key: it may be a typo for another one, which would silently stay.

    Raises
    ------
    SceneError
        The key is missing; the message names the nearest one.
    """
    if key not in here:
        there = [str(other) for other in here]
        raise SceneError(
            f"{change.origin}: {owner or 'the scene'} has no {short(key)} to remove"
            f"{nearest(key, there)}; it has " + (", ".join(there) or "no keys")
        )

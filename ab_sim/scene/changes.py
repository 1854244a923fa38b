"""Changes to the content of a scene's file, each ``key=value`` with a dotted key."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ab_sim.errors import SceneError, nearest
from ab_sim.limited_yaml import read_yaml
from ab_sim.quoting import short

REMOVED: Any = object()
"""Marker for the value of a removed key."""


class Change(NamedTuple):
    """A value for a dotted key, or ``REMOVED``."""

    key: str
    value: Any
    said: str
    """Name of the change in messages."""


def all_parsed(changes: Iterable[str]) -> list[Change]:
    """Parse changes of the form ``key=value``, with the value in YAML.

    An empty one removes the key.

    Raises:
        SceneError: a change has another form, or the changes are not a list of texts.
    """
    given = list(changes)
    if isinstance(changes, str | Mapping) or not all(isinstance(each, str) for each in given):
        raise SceneError(
            f"changes = {short(changes)}: must be a list of texts, e.g. ['balls.mass=0.002']"
        )
    return [_parsed(change) for change in given]


def _parsed(change: str) -> Change:
    key, equals, text = change.partition("=")
    said = f"change {short(change)}"
    if not equals or not all(part.strip() for part in key.split(".")):
        raise SceneError(f"{said}: must be key=value, e.g. balls.mass=0.002")
    try:
        value = read_yaml(text)
    except ValueError as error:
        raise SceneError(f"{said}: the value {error}") from error
    return Change(key.strip(), REMOVED if text.strip() == "" else value, said)


def apply(raw: dict[str, Any], changes: Sequence[Change]) -> None:
    """Apply changes in place to nested mappings; inner mappings are copied before they change.

    Raises:
        SceneError: there is nothing to remove, or a key leads into a value that is not a mapping.
    """
    for change in changes:
        if change.value is REMOVED:
            _remove(raw, change)
        else:
            _set(raw, change)
    # A change of the accuracy replaces the file's solver, and vice versa. If both are changed, the
    # check of the scene reports that they exclude each other.
    given = {change.key.partition(".")[0] for change in changes if change.value is not REMOVED}
    for wanted, other in (("accuracy", "solver"), ("solver", "accuracy")):
        if wanted in given and other not in given:
            raw.pop(other, None)


def _set(raw: dict[str, Any], change: Change) -> None:
    *sections, last = change.key.split(".")
    here = raw
    for section in sections:
        if here.get(section) is None:
            here[section] = {}
        here = _inside(here, section, change)
    here[last] = change.value


def _remove(raw: dict[str, Any], change: Change) -> None:
    *sections, last = change.key.split(".")
    here, owner = raw, "the scene"
    for section in sections:
        _check_there(here, section, owner, change)
        here, owner = _inside(here, section, change), section
    _check_there(here, last, owner, change)
    del here[last]


def _check_there(here: dict[str, Any], key: str, owner: str, change: Change) -> None:
    """Refuse a missing key. It may be a typo for an existing one, which would silently stay."""
    if key not in here:
        there = [str(other) for other in here]
        raise SceneError(
            f"{change.said}: {owner} has no {short(key)} to remove{nearest(key, there)}; it has "
            + (", ".join(there) or "no keys")
        )


def _inside(here: dict[str, Any], section: str, change: Change) -> dict[str, Any]:
    inner = here[section]
    if isinstance(inner, list):
        raise SceneError(
            f"{change.said}: {section} is a list; give the whole of it: {section}=[...]"
        )
    if not isinstance(inner, dict):
        raise SceneError(f"{change.said}: {section} is a value, it has no keys")
    here[section] = own = dict(inner)
    return own

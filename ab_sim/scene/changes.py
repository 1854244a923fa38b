"""Changes to what a scene's file says, each ``key=value`` with a dotted key."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ab_sim.errors import SceneError, nearest
from ab_sim.limited_yaml import read_yaml
from ab_sim.quoting import short

REMOVED: Any = object()
"""Stands for a value that is taken away."""


class Change(NamedTuple):
    """A value for a dotted key, or ``REMOVED``."""

    key: str
    value: Any
    said: str
    """What to call it in messages."""


def all_parsed(changes: Iterable[str]) -> list[Change]:
    """Changes as they are written, ``key=value``, the value in YAML; an empty one removes the key.

    Raises:
        SceneError: one is not written so, or they are no list of texts.
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
    """Make changes to a mapping of nested ones, of which those that change are copied first.

    Raises:
        SceneError: there is nothing to remove, or a key leads into what is no mapping.
    """
    for change in changes:
        if change.value is REMOVED:
            _remove(raw, change)
        else:
            _set(raw, change)
    # Who changes the accuracy does not want the file's solver any more, and vice versa; who
    # changes both is told that they exclude each other, when the scene is checked.
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
    """What is not there may be a slip of the pen for what is, which would silently stay."""
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

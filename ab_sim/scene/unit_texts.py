"""Numbers with their unit in what a scene's file says, made plain numbers before it is checked.

Here, and not in the fields' own validators: a field's choice between one number and a list would
come first, and effects and steppers have their numbers elsewhere.
"""

import functools
from importlib import import_module
from typing import Any

from ab_sim.scene.keys import SceneKey, begins, scene_keys
from ab_sim.scene.registry import effect_classes
from ab_sim.scene.schema import STEPPERS
from ab_sim.scene.units import NO_UNIT, has_unit, in_si

MOST_LEVELS = 10
"""Of keys within each other: more than any scene has, and an end for what contains itself."""

Key = tuple[str, ...]


def without_units(raw: Any, at: Key = ()) -> Any:
    """What a scene says, its texts such as ``12 mm`` as SI numbers; the rest as it is.

    A text stays where its key takes none, or one of another dimension: it is no number, and is
    refused as such when the scene is checked, with all else that is wrong.

    Args:
        raw: the scene or a part of it, nested mappings and lists, effects by name; not changed.
        at: key of that part.
    """
    if isinstance(raw, str):
        return _number(raw, at)
    if len(at) == MOST_LEVELS:
        return raw
    if isinstance(raw, dict):
        return {name: without_units(value, (*at, str(name))) for name, value in raw.items()}
    if type(raw) in (list, tuple):  # and no named tuple, which is an effect that has been checked
        return type(raw)(without_units(value, (*at, str(i))) for i, value in enumerate(raw))
    return raw


def _number(text: str, key: Key) -> str | float:
    if not has_unit(text) or (unit := unit_at(key)) in NO_UNIT:
        return text
    try:
        return in_si(text, unit)
    except ValueError:
        return text


def unit_at(key: Key) -> str:
    """The SI unit of a key, or of the list in which it is an entry.

    Returns:
        "1" of a number without dimension; "-" of what is no number, and where there is no such key.
    """
    registry = import_module(STEPPERS)
    known = _known(tuple(effect_classes().items()), tuple(registry.steppers()))
    for wanted in (key, key[:-1]) if key[-1].isdecimal() else (key,):
        units = {
            unit for parts, unit in known if len(parts) == len(wanted) and begins(parts, wanted)
        }
        if units:  # two steppers may give a name to numbers of different units
            return units.pop() if len(units) == 1 else "-"
    return "-"


@functools.lru_cache(maxsize=8)
def _known(effects: tuple[Any, ...], steppers: tuple[str, ...]) -> tuple[tuple[Key, str], ...]:
    """Keys and their units, as long as these are registered: a program may add to them."""
    rows: list[SceneKey] = scene_keys()
    return tuple((tuple(row.key.split(".")), row.unit) for row in rows)

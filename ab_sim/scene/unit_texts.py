"""Convert numbers with units in a scene's file to plain SI numbers, before the checks.

The fields' validators would be too late: pydantic first chooses between one number and a list. They
would not be enough either: the numbers of effects and steppers are defined elsewhere.
"""

import functools
from importlib import import_module
from typing import Any

from ab_sim.scene.keys import SceneKey, key_starts_with, scene_keys
from ab_sim.scene.registry import effect_classes
from ab_sim.scene.schema import STEPPERS
from ab_sim.scene.units import NO_UNIT, has_unit, in_si

MOST_LEVELS = 10
"""Largest nesting of keys, more than any scene has. It ends the recursion into a structure that
contains itself."""

Key = tuple[str, ...]


def without_units(raw: Any, at: Key = ()) -> Any:
    """Return a scene with texts such as ``12 mm`` as SI numbers, and the rest unchanged.

    A text is kept if its key takes no number, or a number of another dimension. The check of the
    scene then refuses the text, and reports it together with all other errors.

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
    if type(raw) in (list, tuple):  # exact types: a named tuple is a checked effect
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
    """Return the SI unit of a key, or of the list in which it is an entry.

    Returns:
        "1" for dimensionless numbers; "-" for other values and unknown keys.
    """
    registry = import_module(STEPPERS)
    units_of_keys = _known(tuple(effect_classes().items()), tuple(registry.steppers()))
    for wanted in (key, key[:-1]) if key[-1].isdecimal() else (key,):
        units = {
            unit
            for parts, unit in units_of_keys
            if len(parts) == len(wanted) and key_starts_with(parts, wanted)
        }
        if units:  # two steppers may use one name for numbers with different units
            return units.pop() if len(units) == 1 else "-"
    return "-"


@functools.lru_cache(maxsize=8)
def _known(effects: tuple[Any, ...], steppers: tuple[str, ...]) -> tuple[tuple[Key, str], ...]:
    """Return all keys with their units, cached until an effect or stepper is registered."""
    rows: list[SceneKey] = scene_keys()
    return tuple((tuple(row.key.split(".")), row.unit) for row in rows)

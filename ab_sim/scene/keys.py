"""Table of the keys of a scene, from its JSON Schema, and conversion of their numbers to SI.

Numbers with units in a scene's file become plain SI numbers before the checks. The fields'
validators would be too late: pydantic first chooses between one number and a list. They would not
be enough either: the numbers of effects and steppers are defined elsewhere.
"""

import difflib
import functools
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ab_sim.base.errors import InputError, exact, short
from ab_sim.base.registries import registry
from ab_sim.scene.registry import deck_model_ways, effect_classes
from ab_sim.scene.schema import Schema, bare_schema
from ab_sim.scene.units import NO_UNIT, has_unit, in_si

ENTRY, NAME = "N", "NAME"
"""Placeholders in keys for the number of an entry in a list, and for a free name."""
NONE, _REQUIRED = "-", "required"


class SceneKey(NamedTuple):
    """A key of a scene, or a section of keys."""

    key: str
    """Dotted key; ``N`` stands for an entry's number, ``NAME`` for a free name."""
    unit: str
    """SI unit; "1" for dimensionless numbers, "-" for other values."""
    range: str
    """Allowed values; "-" for a section."""
    default: str
    """Default; "required" if there is none, "-" if the key may be missing without a substitute."""
    meaning: str


def scene_keys(section: str = "") -> list[SceneKey]:
    """Return all keys of a scene in the order of declaration, or the keys of one section.

    Parameters
    ----------
    section
        A key or the beginning of keys, dotted, e.g. ``rotor``, ``effects.motor``,
        ``mounts.0.stiffness``, ``balls.mass.1``; empty for all.

    Raises
    ------
    InputError
        There is no such key; the message names the nearest.
    """
    rows = _all_keys()
    wanted = section.split(".") if section else []
    chosen = [row for row in rows if key_starts_with(row.key.split("."), wanted)]
    # An entry of a list has its own row only if `section` names an entry of that list.
    depth = len(wanted)
    chosen = [
        row for row in chosen if not row.key.endswith(f".{ENTRY}") or row.key.count(".") < depth
    ]
    if chosen:
        return chosen
    raise InputError(f"{short(section)}: a scene has no such key{_near(section, rows)}")


def _all_keys() -> Sequence[SceneKey]:
    """Return all keys, which include the parameters of registered effects and steppers."""
    effects, steppers = effect_classes(), registry("steppers").steppers()
    return _keys_with(tuple(effects.items()), tuple(steppers.items()), tuple(deck_model_ways()))


@functools.lru_cache(maxsize=8)
def _keys_with(*registered: tuple[Any, ...]) -> tuple[SceneKey, ...]:
    """Return all keys of a scene, cached per set of registered plug-ins: the schema takes 40 ms."""
    schema = bare_schema()
    return tuple(_below("", schema, schema["$defs"]))


def key_starts_with(key: Sequence[str], wanted: Sequence[str]) -> bool:
    """Return whether a key of the table, which may have placeholders, begins with a scene's key."""
    return len(wanted) <= len(key) and all(
        part == wanted_part or part == NAME or (part == ENTRY and wanted_part.isdecimal())
        for part, wanted_part in zip(key, wanted, strict=False)
    )


def _near(section: str, rows: Sequence[SceneKey]) -> str:
    """Return a hint: keys with a similar spelling, or with this name elsewhere."""
    keys = list(dict.fromkeys(row.key for row in rows))
    alike = difflib.get_close_matches(section, keys, n=3, cutoff=0.75)
    elsewhere = [key for key in keys if key.rpartition(".")[2] == section.rpartition(".")[2]]
    candidates = list(dict.fromkeys((*alike, *elsewhere)))[:5]
    if candidates:
        return f"; did you mean {' or '.join(map(repr, candidates))}?"
    return f"; its sections are: {', '.join(key for key in keys if '.' not in key)}"


def _below(key: str, section: Schema, sections: Schema) -> list[SceneKey]:
    """Return the rows of the keys in a section."""
    needed = section.get("required", ())
    return [
        row
        for name, schema in section["properties"].items()
        for row in _rows(f"{key}.{name}" if key else name, schema, sections, name in needed)
    ]


def _rows(key: str, schema: Schema, sections: Schema, needed: bool) -> Iterator[SceneKey]:
    """Yield the table rows of a key, and of all keys in the section at this key.

    Parameters
    ----------
    key
        Dotted key.
    schema
        JSON Schema of its value.
    sections
        Definitions to which ``$ref`` refers.
    needed
        True if the key is required.
    """
    schema, choices = _resolved(schema, sections)
    kinds = [choice for choice in choices if "kind" in choice.get("properties", ())]
    if kinds:
        yield _section_row(key, schema, needed)
        yield from _of_kinds(key, kinds, sections)
    elif any("description" in choice for choice in choices):
        for choice in choices:  # parameters with one name in several steppers
            yield from _rows(key, choice, sections, needed)
    elif "properties" in schema:
        yield _section_row(key, schema, needed)
        yield from _below(key, schema, sections)
    elif isinstance(schema.get("additionalProperties"), dict):
        yield _section_row(key, schema, needed)
        yield from _rows(f"{key}.{NAME}", schema["additionalProperties"], sections, False)
    elif "properties" in (entry := _resolved(schema.get("items", {}), sections)[0]):
        yield _section_row(key, schema, needed)._replace(range=_range(schema, choices))
        yield from _below(f"{key}.{ENTRY}", entry, sections)
    else:
        meaning, unit = schema.get("description", ""), schema.get("unit", NONE)
        default = _REQUIRED if needed else _default(schema.get("default"))
        yield SceneKey(key, unit, _range(schema, choices), default, meaning)
        lists = [
            alternative for alternative in (schema, *choices) if alternative.get("type") == "array"
        ]
        for entry in lists[:1]:
            yield SceneKey(f"{key}.{ENTRY}", unit, _range(_entry(entry), []), NONE, meaning)


def _resolved(schema: Schema, sections: Schema) -> tuple[Schema, list[Schema]]:
    """Return a schema with references resolved, and its alternatives other than null."""
    if "$ref" in schema:
        keywords = {keyword: value for keyword, value in schema.items() if keyword != "$ref"}
        schema = {**sections[schema["$ref"].rpartition("/")[2]], **keywords}
    alternatives = schema.get("anyOf") or schema.get("oneOf") or []
    choices = [alternative for alternative in alternatives if alternative.get("type") != "null"]
    resolved = [_resolved(choice, sections)[0] for choice in choices]
    if len(resolved) == 1:
        inner, choices = _resolved(choices[0], sections)
        keywords = {keyword: schema[keyword] for keyword in schema.keys() - {"anyOf", "oneOf"}}
        return {**inner, **keywords}, choices
    # If both a list and a mapping by name are allowed, the mapping describes all their keys.
    mappings = [alternative for alternative in resolved if "properties" in alternative]
    if len(mappings) == 1:
        return {**mappings[0], **schema}, []
    return schema, resolved


def _of_kinds(key: str, kinds: list[Schema], sections: Schema) -> Iterator[SceneKey]:
    """Yield the rows of a section that has several kinds, each key once."""
    rows: dict[str, SceneKey] = {}
    of: dict[str, list[str]] = {}
    for kind in kinds:
        name = kind["properties"]["kind"]["const"]
        for row in _below(key, kind, sections):
            of.setdefault(row.key, []).append(name)
            rows.setdefault(row.key, row)
    kind_key = f"{key}.kind"
    yield rows.pop(kind_key)._replace(range=_either(of[kind_key]))
    for row in rows.values():
        if row.key.count(".") == kind_key.count("."):
            row = row._replace(meaning=f"{row.meaning}; of kind {_either(of[row.key])}")
        yield row


def _section_row(key: str, schema: Schema, needed: bool) -> SceneKey:
    """Return the table row of a section; the meaning is the description's first paragraph."""
    meaning = schema["description"].partition("\n\n")[0] if "description" in schema else ""
    return SceneKey(key, NONE, NONE, _REQUIRED if needed else NONE, " ".join(meaning.split()))


def _default(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_default, value))}]"
    if isinstance(value, float):
        return exact(value)
    return NONE if value is None or value == "" else str(value)


def _range(schema: Schema, choices: list[Schema]) -> str:
    """Return the allowed values of a key as text; ``choices`` are alternatives of its schema."""
    if len(choices) > 1:  # one number for all, or one for each
        return f"{_range(choices[0], [])}; one or a list"
    if "enum" in schema:
        return _either([_default(value) for value in schema["enum"]])
    if "const" in schema:
        return str(schema["const"])
    if schema["type"] == "array":
        return _list(schema)
    if schema["type"] == "string":
        return "text"
    interval = _interval(schema)
    if schema["type"] == "integer":
        return f"whole, {interval}" if interval else "whole"
    return interval or "finite"


def _list(schema: Schema) -> str:
    least, most = schema.get("minItems"), schema.get("maxItems")
    entry = _entry(schema)
    count = f"{least} to {most}"
    if least == most or "not" in schema:
        count = f"{least}" if least == most else f"{least} or {most}"
    if "type" not in entry:
        return f"list of {count}" if most else "list"
    values = _range(entry, [])
    return f"{count} of: {values}" if most else f"list of: {values}"


def _entry(schema: Schema) -> Schema:
    """Return the schema of a list's entries."""
    entry: Schema = schema["prefixItems"][0] if "prefixItems" in schema else schema["items"]
    return entry


def _interval(schema: Schema) -> str:
    """Return the bounds of a number as text; empty if there are none."""
    low: Any = schema.get("exclusiveMinimum", schema.get("minimum", -math.inf))
    high: Any = schema.get("exclusiveMaximum", schema.get("maximum", math.inf))
    above = ">" if "exclusiveMinimum" in schema else ">="
    below = "<" if "exclusiveMaximum" in schema else "<="
    if math.isinf(low) and math.isinf(high):
        return ""
    if math.isinf(high):
        return f"{above} {exact(low)}"
    if math.isinf(low):
        return f"{below} {exact(high)}"
    if above == ">=" and below == "<=":
        return f"{exact(low)} to {exact(high)}"
    return f"{above} {exact(low)}, {below} {exact(high)}"


def _either(values: list[str]) -> str:
    *others, last = values
    return f"{', '.join(others)} or {last}" if others else last


MOST_LEVELS = 10
"""Largest nesting of keys, more than any scene has. It ends the recursion into a structure that
contains itself."""

Key = tuple[str, ...]


def without_units(raw: Any, at: Key = ()) -> Any:
    """Return a scene with texts such as ``12 mm`` as SI numbers, and other values unchanged.

    A text is kept if its key takes no number, or a number of another dimension. The check of the
    scene then refuses the text, and reports it together with all other errors.

    Parameters
    ----------
    raw
        The scene or a part of it, nested mappings and lists, effects by name; not changed.
    at
        Key of the part in ``raw``.
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
    """Return the SI unit of the number at a key, which may be an entry of a list.

    Returns
    -------
    str
        "1" for dimensionless numbers; "-" for other values and unknown keys.
    """
    for wanted in (key, key[:-1]) if key[-1].isdecimal() else (key,):
        units = {
            unit
            for parts, unit in _units_of_keys(_all_keys())
            if len(parts) == len(wanted) and key_starts_with(parts, wanted)
        }
        if units:  # two steppers may use one name for numbers with different units
            return units.pop() if len(units) == 1 else "-"
    return "-"


@functools.lru_cache(maxsize=8)
def _units_of_keys(rows: Sequence[SceneKey]) -> tuple[tuple[Key, str], ...]:
    return tuple((tuple(row.key.split(".")), row.unit) for row in rows)

"""A scene file as JSON Schema, made from the models and the registries of what has names.

It refuses what one key can say by itself. What only several keys together can say (a ball's radius
below the race's, a step beyond a stability limit) is left to ``check_scene``.
"""

import inspect
from importlib import import_module
from typing import Any

from ab_sim.scene.deck_models import deck_model_ways
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes, effect_parameters
from ab_sim.scene.units import NUMBER

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"
STEPPERS = "ab_sim.integrate.registry"
"""Knows the steppers. Imported by name, as effects are: imports go from there to this room."""
WITH_UNIT = rf"^\s*{NUMBER}\s*[A-Za-zµμ°(]"
"""How a number with its unit begins; which units are known, and fit, is left to ``check_scene``."""
_BOUNDS = {
    "ge": "minimum",
    "gt": "exclusiveMinimum",
    "le": "maximum",
    "lt": "exclusiveMaximum",
}
"""Pydantic's words where a validator stands between a number and its bounds."""
_NEEDLESS = ("title", "discriminator")


def scene_schema() -> Schema:
    """JSON Schema, draft 2020-12, of a scene file; for editors."""
    schema = bare_schema()
    _with_units(schema)
    return {"$schema": DIALECT, "title": "Scene of ab_sim", **schema}


def bare_schema() -> Schema:
    """The same, each unit in its keyword ``unit`` only, and not in the description too."""
    schema = Scene.model_json_schema()
    sections, keys = schema["$defs"], schema["properties"]
    sections["Effects"] = _effects()
    keys["effects"] = {
        "description": keys["effects"]["description"],
        "anyOf": [{"$ref": "#/$defs/Effects"}, {"type": "array", "items": _entry(sections)}],
    }
    # A sensor's name alone is one with all defaults.
    for section in ("sensors", "probes"):
        sensor = keys[section]["additionalProperties"]
        keys[section]["additionalProperties"] = {"anyOf": [sensor, {"type": "null"}]}
    _add_steppers(sections["Solver"])
    (named, _) = keys["deck_model"]["anyOf"]
    named["enum"] = list(deck_model_ways())
    _tidy(schema)
    return schema


def _effects() -> Schema:
    """Effects by name, each with its parameters."""
    return _section({name: _effect(effect) for name, effect in effect_classes().items()}, [])


def _effect(effect: type[Any]) -> Schema:
    parameters = effect_parameters(effect)
    needed = [name for name, schema in parameters.items() if "default" not in schema]
    section = _section(parameters, needed)
    said = inspect.cleandoc(effect.__doc__ or "")
    said += f"\n\nEquation: {effect.equation}\n\nSource: {effect.source}"
    if needed:
        return {"description": said, **section}
    return {"description": said, "anyOf": [section, {"type": "null"}]}


def _entry(sections: Schema) -> Schema:
    """Of a list of effects: one name with its parameters, or alone, if it needs none."""
    effects = sections["Effects"]["properties"]
    alone = [name for name, schema in effects.items() if "anyOf" in schema]
    one = {"$ref": "#/$defs/Effects", "minProperties": 1, "maxProperties": 1}
    return {"anyOf": [{"enum": alone}, one]}


def _section(keys: Schema, needed: list[str]) -> Schema:
    section: Schema = {"type": "object", "properties": keys, "additionalProperties": False}
    return {**section, "required": needed} if needed else section


def _add_steppers(solver: Schema) -> None:
    """Names of steppers, and what each of them takes."""
    registry = import_module(STEPPERS)
    taken = {name: dict(registry.parameters_of(name)) for name in registry.steppers()}
    solver["properties"]["stepper"]["enum"] = [registry.AUTO, *taken]
    numbers: Schema = {}
    for stepper, parameters in taken.items():
        for key, parameter in parameters.items():
            numbers.setdefault(key, []).append(_number(stepper, parameter))
    given = solver["properties"]["parameters"]
    given |= {
        "properties": {
            key: each[0] if len(each) == 1 else {"anyOf": each} for key, each in numbers.items()
        },
        "additionalProperties": False,
    }
    without_parameters = {"properties": {"parameters": {"maxProperties": 0}}}
    solver["allOf"] = [
        # Also where no stepper is named: that is auto.
        {"if": {"properties": {"stepper": {"const": registry.AUTO}}}, "then": without_parameters},
    ] + [
        {
            "if": {"properties": {"stepper": {"const": name}}, "required": ["stepper"]},
            "then": {"properties": {"parameters": {"propertyNames": {"enum": list(parameters)}}}},
        }
        for name, parameters in taken.items()
    ]


def _number(stepper: str, parameter: Any) -> Schema:
    number: Schema = {
        "type": "number",
        "description": f"{parameter.meaning}; of the stepper {stepper}",
        "unit": parameter.unit,
        "default": parameter.default,
    }
    if parameter.values:
        return {**number, "enum": list(parameter.values)}
    return {**number, "minimum": parameter.lowest, "maximum": parameter.highest}


def _tidy(schema: Any) -> None:
    """Standard keywords for bounds, and none that say nothing; in place."""
    for part in parts_of(schema):
        for own, standard in _BOUNDS.items():
            if own in part:
                part[standard] = part.pop(own)
        for keyword in _NEEDLESS:
            part.pop(keyword, None)


def _with_units(schema: Any) -> None:
    """Units in descriptions, which editors show, and numbers as texts with a unit; in place."""
    for part in parts_of(schema):
        if part.get("unit", "1") != "1":
            part["description"] += f" [{part['unit']}]"
            for number in parts_of(part):
                if number.get("type") == "number":
                    number |= {"type": ["number", "string"], "pattern": WITH_UNIT}


def parts_of(schema: Any) -> list[Schema]:
    """A schema and all that are in it; keys of a section are no keywords."""
    if isinstance(schema, list):
        return [part for each in schema for part in parts_of(each)]
    if not isinstance(schema, dict):
        return []
    found = [schema]
    for keyword, value in schema.items():
        if keyword in ("properties", "$defs"):
            found += [part for each in value.values() for part in parts_of(each)]
        elif keyword not in ("default", "enum", "const"):
            found += parts_of(value)
    return found

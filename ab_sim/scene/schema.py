"""JSON Schema of a scene file, generated from the models and the registries.

The schema refuses errors of a single key. Conditions between several keys (a ball's radius below
the race's, a step beyond a stability limit) are left to ``check_scene``.
"""

import inspect
from typing import Any

from ab_sim.base.registries import registry
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import deck_model_ways, effect_classes, effect_parameters
from ab_sim.scene.units import NUMBER

Schema = dict[str, Any]

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
WITH_UNIT = rf"^\s*{NUMBER}\s*[A-Za-zµμ°(]"
"""Pattern of a number and a unit's first letter; ``check_scene`` checks the whole unit."""
_BOUNDS = {
    "ge": "minimum",
    "gt": "exclusiveMinimum",
    "le": "maximum",
    "lt": "exclusiveMaximum",
}
"""Standard schema keyword of each bound, by the keyword that pydantic writes instead if a validator
stands between number and bound."""
_NEEDLESS = ("title", "discriminator")


def scene_schema() -> Schema:
    """Return the JSON Schema, draft 2020-12, of a scene file; for editors."""
    schema = bare_schema()
    _with_units(schema)
    return {"$schema": _DIALECT, "title": "Scene of ab_sim", **schema}


def bare_schema() -> Schema:
    """Return the schema with units in the keyword ``unit`` only, without units in descriptions."""
    schema = Scene.model_json_schema()
    sections, keys = schema["$defs"], schema["properties"]
    sections["Effects"] = _effects()
    keys["effects"] = {
        "description": keys["effects"]["description"],
        "anyOf": [{"$ref": "#/$defs/Effects"}, {"type": "array", "items": _entry(sections)}],
    }
    # A sensor's name without a value is a sensor with all defaults.
    for section in ("sensors", "probes"):
        sensor = keys[section]["additionalProperties"]
        keys[section]["additionalProperties"] = {"anyOf": [sensor, {"type": "null"}]}
    _add_steppers(sections["Solver"])
    (named, _) = keys["deck_model"]["anyOf"]
    named["enum"] = list(deck_model_ways())
    _tidy(schema)
    return schema


def _effects() -> Schema:
    """Return the schema of a scene's effects: a mapping from effect names to their parameters."""
    return _section({name: _effect(effect) for name, effect in effect_classes().items()}, [])


def _effect(effect: type[Any]) -> Schema:
    """Return the schema of an effect; one without required parameters may have no value."""
    parameters = effect_parameters(effect)
    needed = [name for name, schema in parameters.items() if "default" not in schema]
    section = _section(parameters, needed)
    text = inspect.cleandoc(effect.__doc__ or "")
    text += f"\n\nEquation: {effect.equation}\n\nSource: {effect.source}"
    if needed:
        return {"description": text, **section}
    return {"description": text, "anyOf": [section, {"type": "null"}]}


def _entry(sections: Schema) -> Schema:
    """Return the schema of an entry in a list of effects: a name with or without parameters."""
    effects = sections["Effects"]["properties"]
    alone = [name for name, schema in effects.items() if "anyOf" in schema]
    one = {"$ref": "#/$defs/Effects", "minProperties": 1, "maxProperties": 1}
    return {"anyOf": [{"enum": alone}, one]}


def _section(keys: Schema, needed: list[str]) -> Schema:
    """Return the schema of a mapping that has only ``keys``, and must have the ``needed`` ones."""
    section: Schema = {"type": "object", "properties": keys, "additionalProperties": False}
    return {**section, "required": needed} if needed else section


def _add_steppers(solver: Schema) -> None:
    """Add the names and parameters of the registered steppers to the schema of ``solver``."""
    stepper_registry = registry("steppers")
    taken = {
        name: dict(stepper_registry.parameters_of(name)) for name in stepper_registry.steppers()
    }
    solver["properties"]["stepper"]["enum"] = [stepper_registry.AUTO, *taken]
    numbers: Schema = {}
    for stepper, parameters in taken.items():
        for key, parameter in parameters.items():
            numbers.setdefault(key, []).append(_number(stepper, parameter))
    properties = solver["properties"]["parameters"]
    properties |= {
        "properties": {
            key: number[0] if len(number) == 1 else {"anyOf": number}
            for key, number in numbers.items()
        },
        "additionalProperties": False,
    }
    without_parameters = {"properties": {"parameters": {"maxProperties": 0}}}
    solver["allOf"] = [
        # Without a stepper, auto applies, too.
        {
            "if": {"properties": {"stepper": {"const": stepper_registry.AUTO}}},
            "then": without_parameters,
        },
    ] + [
        {
            "if": {"properties": {"stepper": {"const": name}}, "required": ["stepper"]},
            "then": {"properties": {"parameters": {"propertyNames": {"enum": list(parameters)}}}},
        }
        for name, parameters in taken.items()
    ]


def _number(stepper: str, parameter: Any) -> Schema:
    """Return the schema of a stepper's parameter."""
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
    """Use standard keywords for bounds and remove needless ones, in place."""
    for part in parts_of(schema):
        for ours, standard in _BOUNDS.items():
            if ours in part:
                part[standard] = part.pop(ours)
        for keyword in _NEEDLESS:
            part.pop(keyword, None)


def _with_units(schema: Any) -> None:
    """Add units to descriptions, which editors show, and allow numbers with a unit; in place."""
    for part in parts_of(schema):
        if part.get("unit", "1") != "1":
            part["description"] += f" [{part['unit']}]"
            for number in parts_of(part):
                if number.get("type") == "number":
                    number |= {"type": ["number", "string"], "pattern": WITH_UNIT}


def parts_of(schema: Any) -> list[Schema]:
    """Return a schema and all schemas nested in it."""
    if isinstance(schema, list):
        return [part for entry in schema for part in parts_of(entry)]
    if not isinstance(schema, dict):
        return []
    parts = [schema]
    for keyword, value in schema.items():
        if keyword in ("properties", "$defs"):  # a mapping of schemas by name, itself no schema
            parts += [part for entry in value.values() for part in parts_of(entry)]
        elif keyword not in ("default", "enum", "const"):
            parts += parts_of(value)
    return parts

"""Messages for pydantic's findings, with key, value, allowed range and remedy."""

import difflib
import math
import re
import sys
from collections.abc import Iterable
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ab_sim.base.errors import exact, nearest, short
from ab_sim.scene.keys import unit_at
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import KINDS
from ab_sim.scene.quantities import EACH, ONE
from ab_sim.scene.registry import effect_classes, effect_parameters
from ab_sim.scene.sensors import Accelerometer
from ab_sim.scene.units import in_si

MOST_MESSAGES = 20
"""Largest number of reported findings."""
_INSTEAD = {
    "unbalance": "give rotor.eccentricity, e = U / M0 of an unbalance U",
    "critical_speed": "give effects.suspension.stiffness, k = M w^2 of a critical speed w",
    "damping_ratio": "give effects.suspension.damping, c = 2 zeta M w of a damping ratio zeta",
}
"""Quantities in data sheets, and the keys to use instead."""
_NUMPY = re.compile(r"\s*np\.[a-z]+\d*\((.{1,40})\)\s*")
"""NumPy's notation of a number in Python, ``f"{x!r}"``."""
_BOUNDS = {
    "greater_than": ("gt", "more than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}


def explain(
    error: ValidationError, at: tuple[str, ...], only_own_fields: bool = False
) -> list[str]:
    """Return one message per finding, up to ``MOST_MESSAGES``.

    Parameters
    ----------
    error
        Pydantic's error.
    at
        Key of the checked part in the scene.
    only_own_fields
        True to leave out findings on the whole scene, which may only follow from a part that is
        wrong by itself.
    """
    messages: list[str] = []
    for finding in error.errors(include_url=False):
        if len(messages) == MOST_MESSAGES:
            messages.append(f"and more; {error.error_count()} findings in all")
            break
        loc = _keys((*at, *finding["loc"]))
        if only_own_fields and not finding["loc"]:
            continue
        if finding["type"] == "too_short" and finding["input"]:
            continue  # its entries are reported as separate findings
        messages.append(_message(loc, finding["type"], finding))
    return messages


def _keys(loc: tuple[Any, ...]) -> list[str]:
    """Return the keys in the file, without the tags that discriminated unions add."""
    parts = [str(part) for part in loc]
    if len(parts) > 2 and parts[0] == "profile":
        del parts[1]
    return [part for part in parts if part not in (ONE, EACH, "[key]")]


def _message(loc: list[str], kind: str, finding: Any) -> str:
    key, value = ".".join(loc), finding["input"]
    context = finding.get("ctx", {})
    if kind == "extra_forbidden":
        return f"{key} = {short(value)}: {_unknown(loc)}"
    if kind == "missing" and key == "balls":
        return f"{key}: is missing; add it; without balls, write balls: {{count: 0}}"
    if kind == "missing":
        return f"{key}: is missing; add it{_meaning(loc)}"
    if kind == "finite_number" or _not_finite(value):
        return f"{key} = {short(value)}: must be a finite number{_meaning(loc)}"
    if kind in _BOUNDS:
        bound, words = _BOUNDS[kind]
        return f"{key} = {short(value)}: must be {words} {exact(context[bound])}{_meaning(loc)}"
    if kind in ("float_parsing", "int_parsing") and (numpy := _NUMPY.fullmatch(str(value))):
        return f"{key} = {short(value)}: is NumPy's notation of a number; write {numpy[1]}"
    if kind == "float_parsing" and isinstance(value, str):
        return f"{key} = {short(value)}: {_no_number(value, loc)}{_meaning(loc)}"
    if kind == "float_type" and isinstance(value, int):  # an int beyond the range of floats
        most = sys.float_info.max
        return f"{key} = {short(value)}: must be within +-{most:.2g}{_meaning(loc)}"
    if kind in ("float_type", "float_parsing", "int_type", "int_parsing", "int_from_float"):
        what = "a whole number" if kind.startswith("int") else "a number"
        return f"{key} = {short(value)}: must be {what}{_meaning(loc)}"
    if kind == "value_error":
        text = str(context.get("error", finding["msg"]))
        return text if not loc else f"{key} = {short(value)}: {text}"
    if kind == "too_long":
        most = context["max_length"]
        return f"{key} = {short(value)}: has {len(value)} entries, must be {most}{_meaning(loc)}"
    if kind == "too_short":
        return f"{key} = {short(value)}: needs at least one entry{_meaning(loc)}"
    if kind in ("tuple_type", "list_type"):
        drawn = key == "start.ball_angles" and value == "random"
        hint = f"; to draw them: ab-sim robust --spread {key}={value}" if drawn else ""
        return f"{key} = {short(value)}: must be a list{_meaning(loc)}{hint}"
    if kind == "string_type":
        return f"{key} = {short(value)}: must be a text; put it in quotes"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        kind_given = value.get("kind") if isinstance(value, dict) else value
        return f"{key}.kind = {short(kind_given)}: must be one of {', '.join(KINDS)}"
    if kind == "dict_type":
        return f"{key} = {short(value)}: must be a section `name: ...`{_meaning(loc)}"
    if kind in ("model_type", "named_tuple_type", "model_attributes_type"):
        return f"{key} = {short(value)}: must be a section `key: value`"
    return f"{key} = {short(value)}: {finding['msg']}"


def _no_number(text: str, loc: list[str]) -> str:
    """Return the error in a text that should be a number, alone or with a unit."""
    unit = unit_at(tuple(loc))
    try:
        in_si(text, unit)
    except ValueError as error:
        return str(error)
    return "must be a number"


def _not_finite(value: Any) -> bool:
    try:
        return not math.isfinite(float(value))
    except (TypeError, ValueError, OverflowError):
        return False


def _unknown(loc: list[str]) -> str:
    """Return a hint for an unknown key: its place elsewhere, or the nearest name."""
    name = loc[-1]
    if loc[:-1] == ["effects"]:
        if name == "accelerometer":
            return (
                "it does not act on the motion, so it is no effect; write it under sensors, "
                "e.g. `sensors: {accelerometer: {bandwidth: 200}}`"
            )
        names: list[str] = list(effect_classes())
        return f"no such effect{nearest(name, names)}; known are: {', '.join(names)}"
    names = _known_keys(loc[:-1])
    if loc[:-1] == ["profile"] and name in names:
        fields = (section.model_fields for section in _sections_at(loc[:-1]))
        kinds = [get_args(field["kind"].annotation)[0] for field in fields if name in field]
        return f"not known to this kind; it is a key of {' and '.join(kinds)}, see {loc[0]}.kind"
    allowed = f"; allowed here: {', '.join(names)}" if names else "; it takes no parameters"
    owners = _owners(name)
    if name in _INSTEAD:
        return f"not known here; {_INSTEAD[name]}{allowed}"
    if owners and not difflib.get_close_matches(name, names, n=1, cutoff=0.8):
        return f"not known here, it is a parameter of {' or '.join(owners)}{allowed}"
    return f"not known here{nearest(name, names)}{allowed}"


def _owners(name: str) -> list[str]:
    """Return the full keys at which effects and sensors have a parameter of this name."""
    effects = [
        f"effects.{effect}.{name}"
        for effect, cls in effect_classes().items()
        if name in getattr(cls, "_fields", ())
    ]
    owners = [f"an effect: {' or '.join(effects)}"] if effects else []
    return owners + [f"a sensor: sensors.NAME.{name}"] * (name in Accelerometer.model_fields)


def _known_keys(loc: list[str]) -> list[str]:
    if len(loc) == 2 and loc[0] == "effects":
        return list(getattr(effect_classes()[loc[1]], "_fields", ()))
    sections = _sections_at(loc)
    return list(dict.fromkeys(key for section in sections for key in section.model_fields))


def _sections_at(loc: list[str]) -> list[type[BaseModel]]:
    """Return the classes of which the section at a key may be."""
    if len(loc) > 1 and loc[0] in ("sensors", "probes"):
        loc = [loc[0], *loc[2:]]  # the name in between is free
    sections: list[type[BaseModel]] = [Scene]
    # all entries of a list have one class
    for part in (part for part in loc if not part.isdecimal()):
        annotations = [s.model_fields[part].annotation for s in sections if part in s.model_fields]
        sections = [c for annotation in annotations for c in _classes(annotation)]
    return sections


def _classes(annotation: Any) -> Iterable[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [effect_class for inner in get_args(annotation) for effect_class in _classes(inner)]


def _meaning(loc: list[str]) -> str:
    """Return ``; M, total mass [kg]``, or an empty text if the key has no description."""
    if loc[-1].isdecimal():  # an entry of a list
        loc = loc[:-1]
    if loc[0] == "effects" and len(loc) == 3:
        field = effect_parameters(effect_classes()[loc[1]]).get(loc[2], {})
        description, unit = field.get("description"), field.get("unit")
    else:
        infos = [
            section.model_fields[loc[-1]]
            for section in _sections_at(loc[:-1])
            if loc[-1] in section.model_fields
        ]
        if not infos or not infos[0].description:
            return ""
        description = infos[0].description
        extra = infos[0].json_schema_extra
        unit = extra.get("unit") if isinstance(extra, dict) else None
    return f"; {description}" + (f" [{unit}]" if unit else "") if description else ""

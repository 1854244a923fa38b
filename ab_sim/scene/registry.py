"""The effects that a scene may call for, by name.

An effect is a ``NamedTuple`` class: its fields are its parameters (each a checked number with
meaning and unit), its docstring says what it does and where it comes from, and its methods are
its physics (see ``ab_sim.dynamics.effects``). This room only needs the fields.
"""

from typing import Any, TypeVar

from pydantic import TypeAdapter

EffectClass = TypeVar("EffectClass", bound=type)

_effects: dict[str, type] = {}


def register(name: str) -> Any:
    """Class decorator: make an effect known to scenes under ``name``."""

    def add(effect: EffectClass) -> EffectClass:
        if name in _effects:
            raise ValueError(f"effect {name!r} is registered twice")
        effect.effect_name = name  # type: ignore[attr-defined]
        _effects[name] = effect
        return effect

    return add


def effect_classes() -> dict[str, type]:
    """Every registered effect, in the order of registration."""
    return dict(_effects)


def effect_parameters(effect: type) -> dict[str, dict[str, Any]]:
    """An effect's parameters: name to a dict with ``description``, ``unit`` and the bounds."""
    schema = TypeAdapter(effect).json_schema()
    names = getattr(effect, "_fields", ())
    items = schema.get("prefixItems", [])
    return dict(zip(names, items, strict=True))

"""Registry of the effects that a scene may name.

An effect is a ``NamedTuple`` class. Its fields are its parameters (each a checked number with
meaning and unit), its docstring states its purpose and source, and its methods are its physics (see
``ab_sim.model.equations.effects``). This package only needs the fields, which may have defaults,
and one optional method:

    check_scene(self, scene) -> None
        called with an otherwise valid scene; raises a ValueError if the effect does not apply to
        that scene; the message names key, value, allowed values and remedy
"""

from collections.abc import Callable
from typing import Any, TypeVar

from pydantic import TypeAdapter

from ab_sim.base.named_entries import NamedEntries
from ab_sim.base.plug_ins import load_installed
from ab_sim.base.registries import registry

EffectClass = TypeVar("EffectClass", bound=type[Any])

EFFECTS = NamedEntries[type[Any]]("effect")
"""Registered effects; ``effect_classes`` registers those of the package and of plug-ins first."""


def register(
    name: str,
    *,
    equation: str,
    source: str,
    uses_ball_radius: bool = False,
) -> Callable[[EffectClass], EffectClass]:
    """Return a class decorator that registers an effect.

    Parameters
    ----------
    name
        Name in scenes.
    equation
        Equation of the effect, one line, symbols as in docs/equations.md.
    source
        Source of the equation, with the equation's number there.
    uses_ball_radius
        True if a scene with the effect must give ``balls.radius``.

    Raises
    ------
    ValueError
        Another effect has the name, or a class of the same name.
    """

    def add(effect: EffectClass) -> EffectClass:
        for other, other_class in EFFECTS.items():
            # Error messages name an effect by its class, so equal names would be ambiguous.
            if other != name and other_class.__name__ == effect.__name__:
                raise ValueError(
                    f"effect {name!r}: its class is called {effect.__name__}, as that of the "
                    f"effect {other!r} is; give it a unique name"
                )
        EFFECTS.add(name, effect)
        effect.equation = equation
        effect.source = source
        effect.uses_ball_radius = uses_ball_radius
        return effect

    return add


def effect_classes() -> dict[str, type[Any]]:
    """Return all registered effects, in the order of registration."""
    registry("effects")  # registers them on import
    load_installed()
    return dict(EFFECTS)


def effect_parameters(effect: type[Any]) -> dict[str, dict[str, Any]]:
    """Return the parameters of an effect by name: ``description``, ``unit``, bounds, ``default``.

    A parameter without a ``default`` is required.
    """
    schema = TypeAdapter(effect).json_schema()
    names = getattr(effect, "_fields", ())
    items = schema.get("prefixItems", [])
    return dict(zip(names, items, strict=True))


def deck_model_ways() -> dict[str, int]:
    """Return the number of axes along which the deck moves, by name of the deck model."""
    models = registry("deck models").deck_models()
    return {name: model.kind.AXES for name, model in models.items()}

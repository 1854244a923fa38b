"""The effects that a scene may call for, by name.

An effect is a ``NamedTuple`` class: its fields are its parameters (each a checked number with
meaning and unit), its docstring says what it does and where it comes from, and its methods are
its physics (see ``ab_sim.equations.effects``). This room only needs the fields, which may have
defaults, and one optional method:

    check_scene(self, scene) -> None
        called with a scene that is sound otherwise; raises a ValueError if the effect makes no
        sense in it, whose text names key, value, what is allowed and what to do
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

from pydantic import TypeAdapter

EffectClass = TypeVar("EffectClass", bound=type[Any])

PROVIDER = "ab_sim.equations.effects"
"""Importing it registers the effects. Named here, and imported when somebody asks for them: imports
go from there to this room, and take seconds that not every use of the package has to wait for."""

_effects: dict[str, type[Any]] = {}


def register(
    name: str,
    *,
    equation: str,
    source: str,
    uses_ball_radius: bool = False,
) -> Callable[[EffectClass], EffectClass]:
    """Class decorator: make an effect known to scenes.

    Args:
        name: what scenes call it.
        equation: its equation, one line, symbols as in docs/equations.md.
        source: where that is from, with the equation's number there.
        uses_ball_radius: whether a scene with it has to give ``balls.radius``.

    Raises:
        ValueError: another effect has the name, or a class of the same name.
    """

    def add(effect: EffectClass) -> EffectClass:
        if name in _effects:
            raise ValueError(f"effect {name!r} is registered twice")
        for other, known in _effects.items():
            # Numba tells named tuples apart by no more than their class' name and fields: one of
            # them would be computed by the other's law.
            if known.__name__ == effect.__name__:
                raise ValueError(
                    f"effect {name!r}: its class is called {effect.__name__}, as that of the "
                    f"effect {other!r} is; give it a name of its own"
                )
        effect.equation = equation
        effect.source = source
        effect.uses_ball_radius = uses_ball_radius
        _effects[name] = effect
        return effect

    return add


def effect_classes() -> dict[str, type[Any]]:
    """Every registered effect, in the order of registration."""
    import_module(PROVIDER)
    return dict(_effects)


def effect_parameters(effect: type[Any]) -> dict[str, dict[str, Any]]:
    """An effect's parameters: name to a dict with ``description``, ``unit``, bounds, ``default``.

    A parameter without a ``default`` has to be given.
    """
    schema = TypeAdapter(effect).json_schema()
    names = getattr(effect, "_fields", ())
    items = schema.get("prefixItems", [])
    return dict(zip(names, items, strict=True))

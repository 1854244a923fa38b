"""Sums over a scene's effects that numba resolves while it compiles.

The *types* of a scene's effects say which code its kernel holds: an effect without the method
in question adds nothing, not even a zero, and numba's cache keys on exactly these types.
"""

from collections.abc import Callable
from typing import Any

from numba.extending import overload, register_jitable

COMPILED = {"error_model": "numpy"}


def sum_over_effects(method: str, zero: Any) -> Callable[..., Any]:
    """A function ``total(effects, *arguments)`` that sums ``effect.method(*arguments)``.

    Args:
        method: name of the method; effects that lack it are left out.
        zero: the sum over none; a float, or a pair of floats for a vector.

    Returns:
        A function that serves in compiled code and in plain Python alike.
    """
    pair = isinstance(zero, tuple)

    def total(effects: Any, *arguments: Any) -> Any:
        terms = [getattr(e, method)(*arguments) for e in effects if hasattr(e, method)]
        if pair:
            return tuple(sum(part) for part in zip(*terms, strict=True)) if terms else zero
        return sum(terms, zero)

    @overload(total, jit_options=COMPILED, strict=False)
    def resolve(effects: Any, *arguments: Any) -> Any:
        classes = [effect_class(kind) for kind in effects]
        if not classes:
            return lambda effects, *arguments: zero
        head = getattr(classes[0], method, None)
        if head is None:
            return lambda effects, *arguments: total(effects[1:], *arguments)
        first = register_jitable(**COMPILED)(head)
        if not any(hasattr(cls, method) for cls in classes[1:]):
            return lambda effects, *arguments: first(effects[0], *arguments)
        if pair:

            def add_pairs(effects: Any, *arguments: Any) -> Any:
                f, g = first(effects[0], *arguments), total(effects[1:], *arguments)
                return (f[0] + g[0], f[1] + g[1])

            return add_pairs
        return lambda effects, *arguments: (
            first(effects[0], *arguments) + total(effects[1:], *arguments)
        )

    return total


def any_effect_has(method: str) -> Callable[[Any], bool]:
    """A function of a scene's effects: whether one has the method; a constant when compiled."""

    def present(effects: Any) -> bool:
        return any(hasattr(effect, method) for effect in effects)

    @overload(present, jit_options=COMPILED, strict=False)
    def resolve(effects: Any) -> Any:
        if any(hasattr(effect_class(kind), method) for kind in effects):
            return lambda effects: True
        return lambda effects: False

    return present


def forward(method: str) -> Callable[..., Any]:
    """A function ``call(thing, *arguments)`` that is ``thing.method(*arguments)``."""

    def call(thing: Any, *arguments: Any) -> Any:
        return getattr(thing, method)(*arguments)

    @overload(call, jit_options=COMPILED, strict=False)
    def resolve(thing: Any, *arguments: Any) -> Any:
        body = register_jitable(**COMPILED)(getattr(effect_class(thing), method))
        return lambda thing, *arguments: body(thing, *arguments)

    return call


def effect_class(kind: Any) -> type[Any]:
    """The named-tuple class behind a numba type."""
    found = getattr(kind, "instance_class", None)
    if found is None:
        raise TypeError(f"a named tuple is needed, not {kind}")
    return found

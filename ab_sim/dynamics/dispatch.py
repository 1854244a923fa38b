"""Choices over a scene's effects that numba makes while it compiles.

The *types* of a scene's effects say which code its kernel holds: an effect without the method
in question adds nothing, not even a zero, and numba's cache keys on exactly these types.
"""

import math
from collections.abc import Callable
from typing import Any

from numba.core.types.containers import BaseTuple
from numba.extending import overload, register_jitable

from ab_sim.tracing import functions as traced

APART = {
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    # No reference counts: the arrays belong to the caller for as long as a kernel runs, and a
    # locked count per array and call cost as much as the equations of motion.
    "_nrt": False,
    # Said, because what is not is inherited from whichever caller happens to be compiled first.
    "forceinline": False,
}
"""For functions that are called from several places, or seldom: one copy each, which matters where
events make a kernel large. LLVM still inlines what is small."""
INLINED = {**APART, "forceinline": True}
"""For what is done at each step: calling with so many arguments costs some 100 ns."""

_methods_of: dict[Callable[[Any], bool], tuple[str, ...]] = {}


def sum_over_effects(method: str, zero: Any) -> Callable[..., Any]:
    """A function ``total(effects, *arguments)`` that sums ``effect.method(*arguments)``.

    Args:
        method: name of the method; effects that lack it are left out.
        zero: the sum over none; a float, or a tuple of two, three or four floats for a vector.

    Returns:
        A function that serves in compiled code and in plain Python alike.
    """
    add = {1: _add_numbers, 2: _add_pairs, 3: _add_threes, 4: _add_fours}[
        len(zero) if isinstance(zero, tuple) else 1
    ]

    def total(effects: Any, *arguments: Any) -> Any:
        present = [effect for effect in effects if hasattr(effect, method)]
        if not present:
            return zero
        value = getattr(present[0], method)(*arguments)
        for effect in present[1:]:
            value = add(value, getattr(effect, method)(*arguments))
        return value

    @overload(total, jit_options=INLINED, strict=False)
    def resolve(effects: Any, *arguments: Any) -> Any:
        classes = [effect_class(kind) for kind in effects]
        terms = [(i, getattr(cls, method)) for i, cls in enumerate(classes) if hasattr(cls, method)]
        if not terms:
            return lambda effects, *arguments: zero
        return _sum_of(terms, add)

    return total


def _sum_of(terms: list[tuple[int, Callable[..., Any]]], add: Callable[..., Any]) -> Any:
    """``total`` for these effects, each given by its place among the effects and its method."""
    place, method = terms[0]
    first = register_jitable(**INLINED)(method)
    if len(terms) == 1:
        return lambda effects, *arguments: first(effects[place], *arguments)
    plus = register_jitable(**INLINED)(add)
    others = register_jitable(**INLINED)(_sum_of(terms[1:], add))
    return lambda effects, *arguments: plus(
        first(effects[place], *arguments), others(effects, *arguments)
    )


def _add_numbers(f: Any, g: Any) -> Any:
    return f + g


def _add_pairs(f: Any, g: Any) -> Any:
    return (f[0] + g[0], f[1] + g[1])


def _add_threes(f: Any, g: Any) -> Any:
    return (f[0] + g[0], f[1] + g[1], f[2] + g[2])


def _add_fours(f: Any, g: Any) -> Any:
    return (f[0] + g[0], f[1] + g[1], f[2] + g[2], f[3] + g[3])


def any_effect_has(*methods: str) -> Callable[[Any], bool]:
    """A function of a scene's effects: whether one has one of the methods.

    Compiled, it is a constant, so that the branch not taken is not in the kernel.
    """

    def present(effects: Any) -> bool:
        return any(hasattr(effect, method) for effect in effects for method in methods)

    @overload(present, jit_options=INLINED, strict=False)
    def resolve(effects: Any) -> Any:
        classes = [effect_class(kind) for kind in effects]
        if any(hasattr(cls, method) for cls in classes for method in methods):
            return lambda effects: True
        return lambda effects: False

    _methods_of[present] = methods
    return present


def found_in(kind: Any, present: Callable[[Any], bool]) -> bool:
    """What ``present``, made by ``any_effect_has``, says, of numba's type of a System."""
    classes = [effect_class(each) for each in part_of(kind, "effects")]
    return any(hasattr(cls, method) for cls in classes for method in _methods_of[present])


def chosen_by(
    present: Callable[[Any], bool], yes: Callable[..., Any], no: Callable[..., Any]
) -> Callable[..., Any]:
    """A function ``call(plant, *arguments)``: ``yes`` or ``no``, as the plant's effects ask.

    Unlike an ``if``, it keeps the other one from being compiled at all.

    Args:
        present: made by ``any_effect_has``.
        yes, no: functions of a Plant, or a System, and further arguments; inlined, whatever they
            ask for.
    """

    def call(plant: Any, *arguments: Any) -> Any:
        effects = getattr(plant, "system", plant).effects
        return (yes if present(effects) else no)(plant, *arguments)

    @overload(call, jit_options=INLINED, strict=False)
    def resolve(plant: Any, *arguments: Any) -> Any:
        body = yes if found_in(system_in(plant), present) else no
        return getattr(body, "py_func", body)

    return call


def only_if(present: Callable[[Any], bool], body: Callable[..., Any]) -> Callable[..., Any]:
    """A function ``call(plant, *arguments)``: ``body``, or nothing at all where no effect asks.

    Args:
        present: made by ``any_effect_has``.
        body: function of a Plant, or a System, and further arguments; one that returns something
            returns a bool, and False is returned in its place.
    """
    return chosen_by(present, body, lambda plant, *arguments: False)


def forward(method: str) -> Callable[..., Any]:
    """A function ``call(thing, *arguments)`` that is ``thing.method(*arguments)``."""

    def call(thing: Any, *arguments: Any) -> Any:
        return getattr(thing, method)(*arguments)

    @overload(call, jit_options=INLINED, strict=False)
    def resolve(thing: Any, *arguments: Any) -> Any:
        return getattr(effect_class(thing), method)

    return call


def number_of(count: Any) -> Any:
    """A number, or the length of a tuple: a constant where the compiler looks at it.

    Numba compiles functions one by one, and each has to see for itself how often its loops run.
    """
    return len(count) if isinstance(count, tuple) else count


@overload(number_of, jit_options=INLINED, strict=False)
def _number_of(count):  # type: ignore[no-untyped-def]
    if isinstance(count, BaseTuple):
        length = len(count)
        return lambda count: length
    return lambda count: count


def holds(flag: Any) -> Any:
    """A truth value, or whether a tuple has entries: a constant where the compiler looks at it."""
    return len(flag) > 0 if isinstance(flag, tuple) else flag


@overload(holds, jit_options=INLINED, strict=False)
def _holds(flag):  # type: ignore[no-untyped-def]
    if isinstance(flag, BaseTuple):
        found = len(flag) > 0
        return lambda flag: found
    return lambda flag: flag


def attribute(name: str) -> Callable[[Any], Any]:
    """A function ``read(thing)``: an attribute of the thing's class, compiled as a constant."""

    def read(thing: Any) -> Any:
        return getattr(type(thing), name)

    @overload(read, jit_options=INLINED, strict=False)
    def resolve(thing: Any) -> Any:
        value = getattr(effect_class(thing), name)
        return lambda thing: value

    return read


def system_in(kind: Any) -> Any:
    """The numba type of the System in that of a Plant, or the type itself if it is a System's."""
    return part_of(kind, "system") if "system" in kind.fields else kind


def part_of(kind: Any, field: str) -> Any:
    """The numba type of a named tuple's field."""
    return kind.types[kind.fields.index(field)]


def effect_class(kind: Any) -> type[Any]:
    """The named-tuple class behind a numba type."""
    found = getattr(kind, "instance_class", None)
    if found is None:
        raise TypeError(f"a named tuple is needed, not {kind}")
    return found


# Effects take these of the tracer: until numba is gone, compiled as they were.
overload(traced.cos)(lambda x: lambda x: math.cos(x))
overload(traced.sin)(lambda x: lambda x: math.sin(x))
overload(traced.where)(lambda condition, a, b: lambda condition, a, b: a if condition else b)

"""Print an effect's formulas, traced by one run of each method on expressions."""

import inspect
from typing import Any, NamedTuple

from ab_sim.export.formulas.lines import Equation, Lines, lines_of
from ab_sim.export.formulas.methods import METHODS, EffectMethod
from ab_sim.export.formulas.symbols import Symbols, lifted, symbol_of_field
from ab_sim.model.equations.motion import Ball, DeckMotion
from ab_sim.scene.registry import effect_parameters
from ab_sim.tracing.expression import Graph, reachable_nodes
from ab_sim.tracing.printed import Named, with_local_names

OTHERS = frozenset({"check_scene"})
"""Methods that are not formulas."""


class Formula(NamedTuple):
    """Formula of one method of an effect."""

    method: str
    meaning: str
    """Meaning from ``methods``; empty for a method that is not listed there."""
    lines: Lines
    parameters: dict[str, str]
    """Parameters of the effect by their symbols in the lines, if symbol and name differ."""
    trouble: str = ""
    """Reason why there are no lines; empty if there are."""


class TracedMethod(NamedTuple):
    """Result of a method that was run on expressions."""

    equations: list[Equation]
    quantities: list[Named]
    fields: dict[str, str]
    """Symbols of the effect's fields, by the fields' names."""


def formulas_of(effect: type[Any]) -> list[Formula]:
    """Return all formulas of a class of effects, first those of ``methods`` in its order."""
    formulas = [name for name in dir(effect) if _is_formula(effect, name)]
    order = [
        *(name for name in METHODS if name in formulas),
        *(n for n in formulas if n not in METHODS),
    ]
    return [_formula(effect, name) for name in order]


def _formula(effect: type[Any], name: str) -> Formula:
    meaning = METHODS[name].meaning if name in METHODS else ""
    try:
        traced = traced_method(effect, name)
    except TypeError as error:
        # Branches on traced numbers, and functions of math, raise TypeError.
        return Formula(name, meaning, Lines([], []), {}, str(error))
    nodes = reachable_nodes(equation.right for equation in traced.equations)
    inputs = {node.payload for node in nodes if node.op == "input"}
    named = {
        symbol: field
        for field, symbol in traced.fields.items()
        if symbol != field and symbol in inputs
    }
    return Formula(name, meaning, lines_of(traced.equations, traced.quantities), named)


def traced_method(effect: type[Any], name: str) -> TracedMethod:
    """Run a method of a class of effects on expressions."""
    graph = Graph()
    x = Symbols(graph)
    method = METHODS[name] if name in METHODS else _unknown(effect, name)
    arguments, left_sides = method.arguments(x), method.left(x)
    fields = _field_symbols(
        effect, x.used - {node.payload for node in left_sides if node.op == "input"}
    )
    result, quantities = with_local_names(
        getattr(effect._make(_values(effect, fields, x)), name), *arguments
    )
    result = method.used(result, x)
    right_sides = list(result) if isinstance(result, tuple) else [result]
    if name not in METHODS:
        left_sides = (
            [x(name)]
            if len(right_sides) == 1
            else [x(f"{name}_{k + 1}") for k in range(len(right_sides))]
        )
    sides = zip(left_sides, right_sides, strict=True)
    equations = [Equation(left_side, lifted(graph, value)) for left_side, value in sides]
    return TracedMethod(equations, quantities, fields)


def _is_formula(effect: type[Any], name: str) -> bool:
    if name.startswith("_") or name in OTHERS or hasattr(tuple, name):
        return False
    return inspect.isfunction(inspect.getattr_static(effect, name))


def _field_symbols(effect: type[Any], taken: set[str]) -> dict[str, str]:
    """Return the symbol of each field, or the field's name if the symbol is already taken."""
    symbols: dict[str, str] = {}
    for field, about in effect_parameters(effect).items():
        symbol = symbol_of_field(field, about.get("description", ""))
        symbols[field] = field if symbol in taken or symbol in symbols.values() else symbol
    return symbols


def _values(effect: type[Any], fields: dict[str, str], x: Symbols) -> list[Any]:
    """Return an input for each number; counts and choices get their default values.

    Counts and choices select the operations, so they cannot be inputs.
    """
    values = []
    for field, about in effect_parameters(effect).items():
        if about.get("type") == "number":
            values.append(x(fields[field]))
        else:
            values.append(about.get("default", about.get("minimum", 1)))
    return values


def _unknown(effect: type[Any], name: str) -> EffectMethod:
    """Describe a method that is not in ``methods`` by the names of its arguments."""
    names = list(inspect.signature(getattr(effect, name)).parameters)[1:]
    bodies: dict[str, Any] = {"deck": DeckMotion, "ball": Ball}

    def arguments(x: Symbols) -> list[Any]:
        return [
            bodies[name](*(x(field) for field in bodies[name]._fields))
            if name in bodies
            else x(name)
            for name in names
        ]

    return EffectMethod("", arguments, lambda x: [])

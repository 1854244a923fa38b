"""Print an effect's formulas, traced by one run of each method on expressions.

Methods, with meaning and symbols, are those listed in ``ab_sim.model.equations.effects``.
"""

import inspect
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ab_sim.export.formulas.lines import Equation, Lines, Symbols, lines_of, symbol_of_field
from ab_sim.model.equations.motion import Ball, DeckMotion
from ab_sim.scene.registry import effect_parameters
from ab_sim.tracing.expression import Graph, lifted, reachable_nodes
from ab_sim.tracing.functions import cos, sin
from ab_sim.tracing.printed import Named, with_local_names


def _unchanged(result: Any, x: Symbols) -> Any:
    return result


class EffectMethod(NamedTuple):
    """Method of effects that computes a formula: its arguments, and the sides of its equations."""

    meaning: str
    arguments: Callable[[Symbols], Sequence[Any]]
    """Function that returns the arguments as symbols."""
    left: Callable[[Symbols], Sequence[Any]]
    """Function that returns the left sides of the equations, one for each result."""
    used: Callable[[Any, Symbols], Any] = _unchanged
    """Function that converts the method's result to the equations' right sides."""


def _symbols(*names: str) -> Callable[[Symbols], Sequence[Any]]:
    return lambda x: [x(name) for name in names]


def _turning(x: Symbols) -> Sequence[Any]:
    return [DeckMotion(x("u_1"), x("u_2"), x("v_1"), x("v_2"))]


def _fixed(x: Symbols) -> Sequence[Any]:
    return [DeckMotion(x("u_x"), x("u_y"), x("v_x"), x("v_y"))]


def _ball(x: Symbols) -> Sequence[Any]:
    return [Ball(x("m"), x("a"))]


def _square(x: Symbols) -> Sequence[Any]:
    return [x("|u|") * x("|u|")]


METHODS: dict[str, EffectMethod] = {
    "deck_force": EffectMethod(
        "force on the deck [N], on axes that turn with the rotor", _turning, _symbols("f_1", "f_2")
    ),
    "space_force": EffectMethod(
        "force on the deck [N], on axes fixed in space", _fixed, _symbols("f_x", "f_y")
    ),
    "gravity": EffectMethod(
        "acceleration of gravity across the shaft [m/s^2], a deck in the plane",
        _symbols(),
        _symbols("g_x", "g_y"),
    ),
    "weight": EffectMethod(
        "acceleration of gravity [m/s^2], a deck in space",
        _symbols(),
        _symbols("g_x", "g_y", "g_z"),
    ),
    "mount_stiffening": EffectMethod(
        "additional stiffness of a mount [N/m] at displacement u", _square, _symbols("k")
    ),
    "mount_energy": EffectMethod(
        "energy stored in a mount by this stiffness [J]", _square, _symbols("E")
    ),
    "ball_inertia": EffectMethod(
        "inertia of a ball along the race in addition to its mass [kg]",
        _ball,
        lambda x: [x("I") / (x("a") * x("a"))],
    ),
    "ball_drag": EffectMethod(
        "force on a ball along the race [N]; s': the ball's speed along the race",
        _ball,
        _symbols("F"),
        lambda result, x: -(result * x("s'")),
    ),
    "friction_coefficient": EffectMethod(
        "coefficient of friction: |F| <= nu N; N: normal force of the race",
        _ball,
        _symbols("nu"),
    ),
    "restitution": EffectMethod(
        "ratio of the separation speed of two balls to their approach speed u [m/s]",
        _symbols("u"),
        _symbols("e"),
    ),
    "race_shape": EffectMethod(
        "shape of the race at normal n = (c, s): h, x, radius of curvature l [m], and dl/dtheta",
        lambda x: [cos(x("theta")), sin(x("theta"))],
        lambda x: [x("h") - x("R"), x("x"), x("l") - x("R"), x("dl/dtheta")],
    ),
    "race_arc": EffectMethod(
        "length along the race up to theta [m]",
        _symbols("theta"),
        lambda x: [x("s") - x("R") * x("theta")],
    ),
    "spindle_acceleration": EffectMethod(
        "spindle acceleration in the inertia forces of the bodies [rad/s^2]",
        _symbols("psi''"),
        _symbols("al"),
    ),
    "rotor_moment": EffectMethod(
        "moment of inertia of the rotor about the shaft [kg m^2]", _symbols(), _symbols("I_r")
    ),
    "loop_torque": EffectMethod(
        "torque that the speed loop requests [N m]; w_c: commanded speed",
        lambda x: [x("w_c") - x("w"), x("z")],
        _symbols("T_a"),
    ),
    "integral_rate": EffectMethod(
        "rate of the loop's integral z [rad/s]; clip: limit to +-T_max",
        lambda x: [x("w_c") - x("w"), x("T_a") - x("clip(T_a)")],
        _symbols("z'"),
    ),
    "largest_torque": EffectMethod("limit of the torque [N m]", _symbols(), _symbols("T_max")),
    "back_torque": EffectMethod(
        "loss of torque by back-EMF [N m]: T = clip(T_a) - T_b", _symbols("w"), _symbols("T_b")
    ),
    "deck_energy": EffectMethod("energy stored for deck_force [J]", _turning, _symbols("E")),
    "space_energy": EffectMethod("energy stored for space_force [J]", _fixed, _symbols("E")),
    "deck_loss": EffectMethod("power dissipated by deck_force [W]", _turning, _symbols("P")),
    "space_loss": EffectMethod("power dissipated by space_force [W]", _fixed, _symbols("P")),
}
"""Methods in the order of printing, by name."""


_OTHERS = frozenset({"check_scene"})
"""Methods that are not formulas."""


class Formula(NamedTuple):
    """Formula of one method of an effect."""

    method: str
    meaning: str
    """Meaning from ``METHODS``; empty for a method that is not listed there."""
    lines: Lines
    """Printed equations, and definitions of the quantities in them."""
    parameters: dict[str, str]
    """Names of the effect's parameters by symbol, for those whose symbol is not the name."""
    trouble: str = ""
    """Reason why the formula cannot be printed; empty if ``lines`` has it."""


class TracedMethod(NamedTuple):
    """Result of a method that was run on expressions."""

    equations: list[Equation]
    """One equation per result of the method."""
    quantities: list[Named]
    """Local variables of the method, which may be named in the lines."""
    fields: dict[str, str]
    """Symbols of the effect's fields, by the fields' names."""


def formulas_of(effect: type[Any]) -> list[Formula]:
    """Return all formulas of a class of effects: those in ``METHODS`` in its order, then others."""
    formulas = [name for name in dir(effect) if _is_formula(effect, name)]
    order = [
        *(name for name in METHODS if name in formulas),
        *(n for n in formulas if n not in METHODS),
    ]
    return [_formula(effect, name) for name in order]


def _formula(effect: type[Any], name: str) -> Formula:
    """Return the formula of a method; without lines if the method cannot be traced."""
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
    """Run the method ``name`` of a class of effects on expressions, with symbols as arguments."""
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
    if name.startswith("_") or name in _OTHERS or hasattr(tuple, name):
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
    """Return a description, from argument names, of a method that ``METHODS`` does not list."""
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

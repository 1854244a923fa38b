"""Methods of effects: the meaning, arguments and resulting equation of each method.

These are the methods listed in ``ab_sim.model.equations.effects``, in the symbols of
docs/equations.md.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ab_sim.export.formulas.symbols import Symbols
from ab_sim.model.equations.motion import Ball, DeckMotion
from ab_sim.tracing.functions import cos, sin


def _unchanged(result: Any, x: Symbols) -> Any:
    return result


class EffectMethod(NamedTuple):
    """Method that effects may have."""

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

"""Functions with which a program registers effects and steppers for scenes."""

from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import TypeVar

from ab_sim.engine.integrate import registry as steppers
from ab_sim.engine.integrate.explicit import explicit
from ab_sim.export.formulas.effects import METHODS
from ab_sim.scene import registry as effects

Effect = TypeVar("Effect", bound=type[tuple[object, ...]])
"""Type of an effect class, a NamedTuple."""
_CHECK = "check_scene"
"""Name of the method of an effect that is not a formula."""


def register_effect(
    name: str, *, equation: str, source: str, uses_ball_radius: bool = False
) -> Callable[[Effect], Effect]:
    """Return a class decorator that registers an effect for scenes, in this process.

    An effect is a ``NamedTuple``. Its fields are its parameters, and its methods are its formulas
    in plain Python: ``deck_force``, ``ball_drag`` and others, which
    ``ab_sim.model.equations.effects`` lists. Machine code, derivatives, text and LaTeX are
    generated from the methods. Methods that are not in the list are only called by your own deck
    models.

    Parameters
    ----------
    name : str
        Name of the effect in scenes.
    equation : str
        Equation of the effect in one line, with the symbols of docs/equations.md.
    source : str
        Source of the equation, with its number there.
    uses_ball_radius : bool, default False
        Whether a scene with it must give ``balls.radius``.

    Returns
    -------
    callable
        Decorator, which returns the class.

    Raises
    ------
    ValueError
        Another effect has this name or class name; or the class is not a ``NamedTuple``; or the
        name of a method resembles a name in the list, so that it would not be called.

    Examples
    --------
    >>> import ab_sim
    >>> from typing import NamedTuple
    >>> @ab_sim.register_effect("air_drag", equation="f = -c v", source="this page")
    ... class AirDrag(NamedTuple):
    ...     coefficient: float
    ...     def deck_force(self, deck):
    ...         return -self.coefficient * deck.vx, -self.coefficient * deck.vy
    >>> drive = ab_sim.Drive(ab_sim.load_scene("thesis-hold", ["effects.air_drag.coefficient=0.5"]))
    >>> drive.advance(10).whirl.shape
    (10,)
    """
    effects.effect_classes()  # registers those of the package first, so that their names are taken
    add = effects.register(
        name, equation=equation, source=source, uses_ball_radius=uses_ball_radius
    )

    def checked(effect: Effect) -> Effect:
        _check(name, effect)
        return add(effect)

    return checked


def _check(name: str, effect: type[object]) -> None:
    """Refuse a class that is not a NamedTuple, and methods whose names resemble known ones."""
    if not (issubclass(effect, tuple) and hasattr(effect, "_fields")):
        raise ValueError(
            f"effect {name!r}: its class {effect.__name__} must be a NamedTuple, whose fields are "
            "its parameters"
        )
    for method, value in vars(effect).items():
        if not callable(value) or method.startswith("_") or method in METHODS or method == _CHECK:
            continue
        if near := get_close_matches(method, [*METHODS, _CHECK], n=1, cutoff=0.85):
            raise ValueError(
                f"effect {name!r}: its method {method!r} would not be called; did you mean "
                f"{near[0]!r}? Begin its name with an underscore if it is a helper; "
                "ab_sim.model.equations.effects lists what is called"
            )


def register_stepper(
    name: str, order: int, source: str, rows: Sequence[Sequence[float]], weights: Sequence[float]
) -> None:
    """Register an explicit Runge-Kutta method for scenes, in this process.

    Its step is emitted as machine code for each scene, for single runs and for eight side by side.

    Parameters
    ----------
    name : str
        Name in a scene's ``solver.stepper``.
    order : int
        Declared order.
    source : str
        Source of the method.
    rows : sequence of sequences of float
        Rows of Butcher's tableau below the diagonal, for all stages except the first; row i has at
        most i numbers. Stage times are their sums.
    weights : sequence of float, shape (stages,)
        Weights of the stages in the step.

    Raises
    ------
    ValueError
        The name is taken.

    Notes
    -----
    The method is also a candidate for scenes that request an accuracy.

    Examples
    --------
    >>> import ab_sim
    >>> ab_sim.register_stepper("midpoint", 2, "Runge (1895)", rows=[[0.5]], weights=[0.0, 1.0])
    >>> changes = ["solver.stepper=midpoint", "solver.step=1e-4"]
    >>> ab_sim.Drive(ab_sim.load_scene("nsc-case-1", changes)).advance(10).whirl.shape
    (10,)
    """
    steppers.steppers()  # registers those of the package first, so that their names are taken
    steppers.register(explicit(name, order, source, rows, weights))

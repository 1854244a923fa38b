"""Sums over a scene's effects, and over the balls."""

from collections.abc import Iterable
from typing import Any

from ab_sim.base.errors import InputError
from ab_sim.tracing.functions import total

Number = Any
"""A float or an expression; for balls, an expression that stands for a number per ball."""


def over_effects(effects: Iterable[Any], method: str, zero: Any, *arguments: Any) -> Any:
    """Return the sum of ``effect.method(*arguments)`` over the effects that have the method.

    Parameters
    ----------
    effects
        Effects of a scene.
    method
        Name of a method, see ``ab_sim.model.equations.effects``.
    zero
        Sum if no effect has the method: a number, or a tuple of numbers for a vector.
    *arguments
        Arguments of the method.

    Raises
    ------
    InputError
        A method returns another number of results than ``zero`` has.
    """
    total_ = zero
    for effect in effects:
        if hasattr(effect, method):
            term = getattr(effect, method)(*arguments)
            _check_results(effect, method, term, zero)
            if isinstance(zero, tuple):
                total_ = tuple(a + b for a, b in zip(total_, term, strict=True))
            else:
                total_ = total_ + term
    return total_


def _check_results(effect: Any, method: str, term: Any, zero: Any) -> None:
    """Refuse a result of an effect's method with another shape than ``zero``."""
    result_shape, wanted = _shape(term), _shape(zero)
    if result_shape != wanted:
        raise InputError(
            f"{type(effect).__name__}.{method} returns {result_shape}; must return {wanted}"
        )


def _shape(term: Any) -> str:
    if term is None:
        return "nothing"
    return f"a tuple of {len(term)}" if isinstance(term, tuple | list) else "a number"


def any_has(effects: Iterable[Any], *methods: str) -> bool:
    """Return whether one of the effects has one of the methods."""
    return any(hasattr(effect, method) for effect in effects for method in methods)


def over_balls(count: int, term: Number) -> Number:
    """Return the sum of a number per ball over the balls; 0 without balls."""
    if isinstance(term, float):
        return count * term
    return total(term) if count else 0.0

"""Constants of a scene in memory: traced as inputs, filled in with numbers.

Raw constants come first, in the order in which ``flattened`` goes through them; columns of the
balls behind those of deck and effects; then the place on the speed profile, which a driver changes
from step range to step range; then what follows from them, which the emitted ``prepare`` fills in.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ab_sim.dynamics.system import System, constants_of_balls
from ab_sim.equations.race import BallConstants

PLACE_FIELDS = ("phase", "until", "angle")
"""Behind the fields of a segment."""


class ConstantsLayout(NamedTuple):
    """Where raw constants are."""

    scalars: tuple[str, ...]
    """Names of those of deck and effects, from 0 on."""
    balls: int
    """Where the columns of the balls begin."""
    place: int
    """Where the place on the speed profile begins."""
    size: int
    """Of all."""


def flattened(value: Any, name: str) -> Iterator[tuple[str, float]]:
    """The floats in nested tuples and arrays, each with a name."""
    if type(value) is float or isinstance(value, np.floating):
        yield name, float(value)
    elif isinstance(value, np.ndarray):
        for k, line in enumerate(value):
            yield from flattened(tuple(line.tolist()) if line.ndim else float(line), f"{name}.{k}")
    elif isinstance(value, tuple):
        names = getattr(value, "_fields", range(len(value)))
        for part, each in zip(names, value, strict=True):
            yield from flattened(each, f"{name}.{part}")


def traced(value: Any, name: str, make: Callable[[str], Any]) -> Any:
    """The same nested tuples with what ``make`` gives for a name in place of each float.

    What is no float, as a count or a choice, stays: it decides what is computed.
    """
    if type(value) is float or isinstance(value, np.floating):
        return make(name)
    if isinstance(value, np.ndarray):
        lines = [tuple(line.tolist()) if line.ndim else float(line) for line in value]
        return tuple(traced(line, f"{name}.{k}", make) for k, line in enumerate(lines))
    if isinstance(value, tuple):
        names = getattr(value, "_fields", range(len(value)))
        parts = [traced(v, f"{name}.{part}", make) for part, v in zip(names, value, strict=True)]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def layout_of_constants(system: System, segment: type[Any]) -> ConstantsLayout:
    """Where the constants of a system are, with segments of a kind."""
    scalars = tuple(name for name, _ in flattened(_bodies(system), ""))
    n = len(system.balls)
    place = len(scalars) + n * (len(BallConstants._fields) - 1)
    size = place + len(segment._fields) + len(PLACE_FIELDS)
    return ConstantsLayout(scalars, len(scalars), place, size)


def numbers_of(system: System) -> np.ndarray:
    """Raw constants of a system but for its place on the profile."""
    scalars = [number for _, number in flattened(_bodies(system), "")]
    return np.concatenate([scalars, constants_of_balls(system).ravel()])


def traced_bodies(system: System, make: Callable[[str], Any]) -> tuple[Any, tuple[Any, ...]]:
    """Deck and effects of a system with expressions for numbers."""
    deck, effects = traced(_bodies(system), "", make)
    return deck, effects


def traced_balls(count: int, make: Callable[[str], Any]) -> BallConstants:
    """Constants of so many balls."""
    return BallConstants(count, *(make(name) for name in BallConstants._fields[1:]))


def pattern(system: System) -> Any:
    """What code follows from: types, and what is no float; equal for scenes that share code."""
    return _pattern(_bodies(system))


def _bodies(system: System) -> tuple[Any, tuple[Any, ...]]:
    return system.deck_model, system.effects


def _pattern(value: Any) -> Any:
    if type(value) is float or isinstance(value, np.floating):
        return float
    if isinstance(value, np.ndarray):
        return value.shape
    if isinstance(value, tuple):
        return type(value), tuple(map(_pattern, value))
    return value

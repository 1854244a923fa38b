"""Constants of a scene in memory: traced as inputs, filled in with numbers.

Their order in memory: raw constants of deck and effects, in the order of ``flattened``; columns of
the balls; the place on the speed profile, which a driver changes from one range of steps to the
next; derived constants, which the emitted ``prepare`` computes.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ab_sim.model.dynamics.system import System, constants_of_balls, stacked
from ab_sim.model.equations.motion import BALL_COLUMNS, ActiveSegment, BallConstants

PLACE_FIELDS = ActiveSegment._fields[1:]
"""Names of the constants of the place on the profile that follow those of the speed law."""


class ConstantsLayout(NamedTuple):
    """Positions of the raw constants in memory."""

    scalars: tuple[str, ...]
    """Names of the constants of deck and effects, which begin at 0."""
    balls: int
    """Position of the first column of the balls."""
    place: int
    """Position of the place on the speed profile."""
    size: int
    """Number of raw constants."""


def flattened(value: Any, name: str, like: Any = None) -> Iterator[tuple[str, Any]]:
    """Yield the floats in nested tuples and arrays, each with a name.

    With ``like``, a value of the same form, its floats decide what is yielded: columns, too.
    """
    like = value if like is None else like
    if type(like) is float or isinstance(like, np.floating):
        yield name, value
    elif isinstance(like, np.ndarray | tuple):
        names = getattr(like, "_fields", range(len(like)))
        for part, item, like_item in zip(names, value, like, strict=True):
            yield from flattened(item, f"{name}.{part}", like_item)


def replace_floats(value: Any, name: str, make: Callable[[str], Any]) -> Any:
    """Return nested tuples with each float replaced by ``make(name of the float)``.

    Other values, such as counts and choices, stay, because they decide which code is traced.
    """
    if type(value) is float or isinstance(value, np.floating):
        return make(name)
    if isinstance(value, np.ndarray):
        lines = [tuple(line.tolist()) if line.ndim else float(line) for line in value]
        return tuple(replace_floats(line, f"{name}.{k}", make) for k, line in enumerate(lines))
    if isinstance(value, tuple):
        names = getattr(value, "_fields", range(len(value)))
        parts = [
            replace_floats(v, f"{name}.{part}", make) for part, v in zip(names, value, strict=True)
        ]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def layout_of_constants(system: System, segment: type[Any]) -> ConstantsLayout:
    """Return the layout of a system's constants, for a class of segments."""
    scalars = tuple(name for name, _ in flattened(_bodies(system), ""))
    n = len(system.balls)
    place = len(scalars) + n * len(BALL_COLUMNS)
    size = place + len(segment._fields) + len(PLACE_FIELDS)
    return ConstantsLayout(scalars, len(scalars), place, size)


def numbers_of(system: System, like: System | None = None) -> np.ndarray:
    """Return the raw constants of a system, except its place on the profile.

    For a system with columns, ``like`` is one with numbers, and the shape is (runs, constants).
    """
    scalars = flattened(_bodies(system), "", _bodies(like) if like else None)
    balls = constants_of_balls(system)
    of_balls = balls.reshape(-1, *balls.shape[2:])
    return stacked([*(number for _, number in scalars), *of_balls]).T


def traced_bodies(system: System, make: Callable[[str], Any]) -> tuple[Any, tuple[Any, ...]]:
    """Return deck and effects of a system with expressions instead of numbers."""
    deck, effects = replace_floats(_bodies(system), "", make)
    return deck, effects


def traced_balls(count: int, make: Callable[[str], Any]) -> BallConstants:
    """Return the constants of ``count`` balls as expressions."""
    return BallConstants(count, *(make(name) for name in BALL_COLUMNS))


def pattern(system: System) -> Any:
    """Return everything on which code depends: types, and values other than floats.

    Scenes with equal patterns share their code.
    """
    return _pattern(_bodies(system))


def _bodies(system: System) -> tuple[Any, tuple[Any, ...]]:
    """Return the deck model and the effects, whose floats are raw constants."""
    return system.deck_model, system.effects


def _pattern(value: Any) -> Any:
    """Return nested tuples with ``float`` in place of floats, and shapes in place of arrays."""
    if type(value) is float or isinstance(value, np.floating):
        return float
    if isinstance(value, np.ndarray):
        return value.shape
    if isinstance(value, tuple):
        return type(value), tuple(map(_pattern, value))
    return value

"""JSON-able values with one random change."""

import copy
import math
import random
from collections.abc import Iterator
from typing import Any

VALUES: list[Any] = [
    *(math.nan, math.inf, -math.inf, 1e308, -1e300, 9e15, 1e9, -1e9, 1e-320, -0.0, 7.25),
    *(-1, 0, 1, 3, 2**31, 2**53 + 1, 2**62, 2**63 - 1, -(2**63), 10**40),
    *(None, True, "", "ramp", "1", [], {}, [[]], [math.nan], [1e300, 1e300]),
]


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each container within a value, with each of its keys."""
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
        yield value, key
        if isinstance(inner, dict | list):
            yield from places(inner)


def changed(run: dict[str, Any], rng: random.Random) -> tuple[dict[str, Any], str]:
    """Return a copy with one value replaced, scaled or removed, and a description of the change."""
    copied = copy.deepcopy(run)
    container, key = rng.choice(list(places(copied)))
    before, chance = container[key], rng.random()
    if chance < 0.1:
        del container[key]
        return copied, f"{key}: {before!r} removed"
    is_number = isinstance(before, int | float) and not isinstance(before, bool)
    if is_number and chance < 0.5:
        container[key] = before * rng.choice([-1, 2, 1e3, 1e12, 1 + 1e-9])
    else:
        container[key] = rng.choice(VALUES)
    return copied, f"{key}: {before!r} -> {container[key]!r}"

"""Points of a sweep: values of the keys in each run."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ab_sim.base.errors import InputError, short
from ab_sim.design.variables import ListedValues, Range, Variable

MOST = 10_000_000
"""Largest number of runs of a sweep."""


class Points(Protocol):
    """Values of keys for each of many runs."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, dotted."""

    def __len__(self) -> int:
        """Return the number of runs."""

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, in the order of the keys."""

    def report(self) -> dict[str, Any]:
        """Return the values that define the points, JSON-able; equal for equal points only."""


@dataclass(frozen=True)
class GridPoints:
    """All combinations of values; the last key changes fastest."""

    axes: tuple[ListedValues, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, dotted."""
        return tuple(axis.key for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values per key."""
        return tuple(len(axis.values) for axis in self.axes)

    def __len__(self) -> int:
        return math.prod(self.shape)

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        places = np.unravel_index(run, self.shape)
        return tuple(axis.values[int(place)] for axis, place in zip(self.axes, places, strict=True))

    def report(self) -> dict[str, Any]:
        """Return the defining values, see ``Points``."""
        return {"grid": {axis.key: list(axis.values) for axis in self.axes}}


class DesignPoints:
    """Points of a space-filling design over ranges, by scipy.stats.qmc.

    Args:
        ranges: ranges, one per key.
        design: ``sobol`` or ``lhs``, Latin hypercube; scrambled.
        count: number of points; a power of 2 for ``sobol``.
        seed: seed of the design's random numbers.
    """

    def __init__(self, ranges: Sequence[Range], design: str, count: int, seed: int) -> None:
        from scipy.stats import qmc

        self.ranges, self.design, self._count, self._seed = tuple(ranges), design, count, seed
        if design == "sobol":
            engine: qmc.QMCEngine = qmc.Sobol(len(ranges), rng=np.random.default_rng(seed))
        else:
            engine = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed))
        shares = engine.random(count)
        self._columns = [range_.at(shares[:, k]) for k, range_ in enumerate(self.ranges)]

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, dotted."""
        return tuple(range_.key for range_ in self.ranges)

    def __len__(self) -> int:
        return self._count

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        return tuple(column[run].item() for column in self._columns)

    def report(self) -> dict[str, Any]:
        """Return the defining values, see ``Points``."""
        ranges = {
            range_.key: [range_.low, range_.high, range_.log, range_.whole]
            for range_ in self.ranges
        }
        return {"design": self.design, "count": self._count, "seed": self._seed, "ranges": ranges}


def points_of(variables: Sequence[Variable], design: str | None, seed: int = 0) -> Points:
    """Return points over variables.

    Args:
        variables: at least one variable; all with values for a grid, all ranges for a design.
        design: ``sobol:COUNT`` or ``lhs:COUNT``; None: a grid.
        seed: seed of a design's random numbers.

    Raises:
        InputError: the arguments do not fit together; the message states why.
    """
    if not variables:
        raise InputError("nothing varies; name a key and its values, e.g. balls.mass=0.001,0.002")
    check_keys([variable.key for variable in variables])
    if design is None:
        return _grid(variables)
    kind, colon, count = design.partition(":")
    if kind not in ("sobol", "lhs") or not colon or not count.isdecimal() or len(count) > 9:
        raise InputError(
            f"design {short(design)}: must be sobol:COUNT or lhs:COUNT, e.g. sobol:4096"
        )
    if kind == "sobol" and int(count).bit_count() != 1:
        raise InputError(f"design {design}: for sobol the count must be a power of 2, e.g. 1024")
    ranges = [variable for variable in variables if isinstance(variable, Range)]
    for variable in variables:
        if not isinstance(variable, Range):
            raise InputError(
                f"{variable.key}: is a list of values; a design takes ranges, "
                f"{variable.key}=FROM..TO"
            )
    _check_count(int(count))
    return DesignPoints(ranges, kind, int(count), seed)


def check_keys(keys: Sequence[str]) -> None:
    """Refuse a key that is named twice, or lies within another one.

    Raises:
        InputError: a key is refused; the message names it.
    """
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{key}: varies twice; name it once")
    check_within(keys)


def check_within(keys: Sequence[str]) -> None:
    """Refuse a key within another key: the result would depend on their order.

    Raises:
        InputError: a key is refused; the message names both.
    """
    for key in keys:
        for other in keys:
            if key.startswith(f"{other}."):
                raise InputError(f"{key}: lies within {other}, which varies, too; name one of them")


def _grid(variables: Sequence[Variable]) -> GridPoints:
    for variable in variables:
        if isinstance(variable, Range):
            raise InputError(
                f"{variable.key}: from {variable.low:g} to {variable.high:g}: needs a number of "
                f"values; write {variable.key}={variable.low:g}..{variable.high:g}:COUNT, or use a "
                "design"
            )
    grid = GridPoints(
        tuple(variable for variable in variables if isinstance(variable, ListedValues))
    )
    _check_count(len(grid))
    return grid


def _check_count(count: int) -> None:
    if not 1 <= count <= MOST:
        raise InputError(f"{count} runs: must be from 1 to {MOST}; take fewer values")

"""Variations of a batch, by run or by key."""

from collections.abc import Mapping, Sequence
from typing import Any, overload

import numpy as np

from ab_sim.base.errors import InputError, short
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene

Variations = Sequence[Mapping[str, object]] | Mapping[str, Sequence[object] | np.ndarray]
"""Values by dotted key for each run, or values of all runs by dotted key."""


def values_of_runs(variations: Variations) -> Sequence[Mapping[str, object]]:
    """Return the values of each run.

    Raises:
        InputError: there is no run, or the argument has another form.
    """
    if isinstance(variations, Mapping):
        lengths = {
            len(column) if isinstance(column, list | tuple) or _is_array(column) else 0
            for column in variations.values()
        }
        if len(lengths) == 1 and 0 not in lengths:
            return ByKey(variations)
    elif isinstance(variations, Sequence) and not isinstance(variations, str) and variations:
        return variations
    raise InputError(
        f"variations = {short(variations)}: must be a list with one mapping per run, {{}} for the "
        "scene itself; or a mapping of keys to lists or arrays, all with a value for each run"
    )


def _is_array(column: object) -> bool:
    return isinstance(column, np.ndarray) and column.ndim > 0


class ByKey(Sequence[Mapping[str, object]]):
    """Values by key, as a sequence with one mapping per run.

    Args:
        columns: values of all runs by dotted key.
    """

    def __init__(self, columns: Mapping[str, Sequence[object] | np.ndarray]) -> None:
        self.columns = dict(columns)
        """Original columns."""

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @overload
    def __getitem__(self, index: int) -> Mapping[str, object]: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Mapping[str, object]]: ...

    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return ByKey({key: column[index] for key, column in self.columns.items()})
        values = ((key, column[index]) for key, column in self.columns.items())
        # Convert to plain Python types, which scenes accept.
        numpy = np.generic, np.ndarray
        return {key: v.tolist() if isinstance(v, numpy) else v for key, v in values}


def by_key(variations: Sequence[Mapping[str, object]]) -> dict[str, Any]:
    """Return values of all runs by dotted key, None if missing; empty if keys are not texts."""
    if isinstance(variations, ByKey):
        return variations.columns
    if not all(isinstance(variation, Mapping) for variation in variations):
        return {}
    keys = dict.fromkeys(key for variation in variations for key in variation)
    if not all(isinstance(key, str) for key in keys):
        return {}
    return {key: [variation.get(key) for variation in variations] for key in keys}


def varied(scene: Scene, variations: Sequence[Mapping[str, object]]) -> list[Scene]:
    """Return the scenes of a batch.

    Raises:
        SceneError: a scene is not valid; the message contains its number, from 0, and its key.
    """
    return [varied_scene(scene, variation, number) for number, variation in enumerate(variations)]


def varied_scene(scene: Scene, variation: Mapping[str, object], number: int) -> Scene:
    """Return the scene of one run.

    Raises:
        SceneError: see ``varied``.
    """
    return changed_scene(scene, variation, f"variation {number}")

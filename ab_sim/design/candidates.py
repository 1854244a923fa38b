"""Candidates of a tuning, each with the random drives that it is evaluated with."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.design.draws import DrawnPoints
from ab_sim.design.judged import Job, varied_scene
from ab_sim.design.tolerances import Tolerance
from ab_sim.design.variables import Range
from ab_sim.scene.model import Scene


class Spreading:
    """Spread of the drives of a design.

    Args:
        tolerances: tolerances; empty for identical drives.
        draws: number of drives per candidate.
        seed: seed of the random numbers, the same for all candidates.
    """

    def __init__(self, tolerances: Sequence[Tolerance], draws: int, seed: int) -> None:
        self.tolerances, self.seed = tuple(tolerances), seed
        self.draws = draws if tolerances else 1

    def report(self) -> dict[str, Any]:
        """Return the defining values, JSON-able."""
        return {
            "spread": [tolerance.report() for tolerance in self.tolerances],
            "draws": self.draws,
            "seed": self.seed,
        }


class Candidates:
    """Points that grow during a search: a run for each draw of each candidate.

    Args:
        scene: scene with varied keys.
        ranges: ranges of the varied keys.
        spreading: spread of drives around a candidate.
        study: defining values of the study, JSON-able.
    """

    def __init__(
        self,
        scene: Scene,
        ranges: Sequence[Range],
        spreading: Spreading,
        study: dict[str, Any],
    ) -> None:
        self._scene, self._spreading, self._study = scene, spreading, study
        self._whole = [range_.whole for range_ in ranges]
        self._varied = tuple(range_.key for range_ in ranges)
        spread = dict.fromkeys(tolerance.key for tolerance in spreading.tolerances)
        self.keys = (*self._varied, *(key for key in spread if key not in self._varied))
        self.values: list[tuple[Any, ...]] = []
        """Values of each candidate, in the order of the ranges."""

    def __len__(self) -> int:
        return len(self.values) * self._spreading.draws

    def add(self, values: np.ndarray) -> range:
        """Add candidates, shape (candidates, keys), and return the indices of their runs."""
        first = len(self)
        for row in values.tolist():
            self.values.append(
                tuple(int(v) if whole else v for v, whole in zip(row, self._whole, strict=True))
            )
        return range(first, len(self))

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        candidate, draw = divmod(run, self._spreading.draws)
        candidate_values = self.values[candidate]
        drawn = self._drawn(candidate)
        if drawn is None:
            return candidate_values + (None,) * (len(self.keys) - len(candidate_values))
        spread = dict(zip(drawn.keys, drawn.at(draw), strict=True))
        values = dict(zip(self._varied, candidate_values, strict=True)) | spread
        return tuple(values[key] for key in self.keys)

    def report(self) -> dict[str, Any]:
        """Return the study, see ``Points``."""
        return self._study

    def scene_of(self, candidate: int) -> Scene:
        """Return the nominal scene of a candidate.

        Raises:
            SceneError: the values give no valid scene; the message states why.
        """
        return varied_scene(Job(self._scene, self._varied, ()), self.values[candidate])

    @functools.lru_cache(maxsize=4)  # noqa: B019  # runs of a candidate are requested together
    def _drawn(self, candidate: int) -> DrawnPoints | None:
        """Return the drives of a candidate; None without spread or without a valid scene."""
        if not self._spreading.tolerances:
            return None
        try:
            scene = self.scene_of(candidate)
        except SceneError:
            return None
        spreading = self._spreading
        return DrawnPoints(scene, spreading.tolerances, spreading.draws, spreading.seed)

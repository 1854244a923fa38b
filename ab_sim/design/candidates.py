"""Candidates of a tuning, each with the draws of built drives that it is judged by."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim.design.draws import DrawnPoints
from ab_sim.design.judged import Job, varied_scene
from ab_sim.design.tolerances import Tolerance
from ab_sim.design.variables import Range
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene


class Spreading:
    """How drives of a design differ.

    Args:
        tolerances: none where they do not.
        draws: drives for each candidate.
        seed: of the random numbers, the same for all candidates.
    """

    def __init__(self, tolerances: Sequence[Tolerance], draws: int, seed: int) -> None:
        self.tolerances, self.seed = tuple(tolerances), seed
        self.draws = draws if tolerances else 1

    def report(self) -> dict[str, Any]:
        """What it follows from, JSON-able."""
        return {
            "spread": [each.report() for each in self.tolerances],
            "draws": self.draws,
            "seed": self.seed,
        }


class Candidates:
    """Points that are asked for one after the other: a run for each draw of each candidate.

    Args:
        scene: of which some keys vary.
        ranges: of these keys.
        spreading: how drives differ from a candidate.
        study: what all follows from, JSON-able.
    """

    def __init__(
        self,
        scene: Scene,
        ranges: Sequence[Range],
        spreading: Spreading,
        study: dict[str, Any],
    ) -> None:
        self._scene, self._spreading, self._study = scene, spreading, study
        self._whole = [each.whole for each in ranges]
        self._varied = tuple(each.key for each in ranges)
        spread = dict.fromkeys(each.key for each in spreading.tolerances)
        self.keys = (*self._varied, *(key for key in spread if key not in self._varied))
        self.values: list[tuple[Any, ...]] = []
        """Of each candidate, in the order of the ranges."""

    def __len__(self) -> int:
        return len(self.values) * self._spreading.draws

    def add(self, values: np.ndarray) -> range:
        """More of them, shape (candidates, keys); the numbers of their runs."""
        first = len(self)
        for row in values.tolist():
            self.values.append(
                tuple(int(v) if whole else v for v, whole in zip(row, self._whole, strict=True))
            )
        return range(first, len(self))

    def at(self, run: int) -> tuple[Any, ...]:
        """See ``Points``."""
        candidate, draw = divmod(run, self._spreading.draws)
        own = self.values[candidate]
        drawn = self._drawn(candidate)
        if drawn is None:
            return own + (None,) * (len(self.keys) - len(own))
        spread = dict(zip(drawn.keys, drawn.at(draw), strict=True))
        values = dict(zip(self._varied, own, strict=True)) | spread
        return tuple(values[key] for key in self.keys)

    def report(self) -> dict[str, Any]:
        """See ``Points``."""
        return self._study

    def scene_of(self, candidate: int) -> Scene:
        """The drawing of a candidate.

        Raises:
            SceneError: there is none; says why.
        """
        return varied_scene(Job(self._scene, self._varied, ()), self.values[candidate])

    @functools.lru_cache(maxsize=4)  # noqa: B019  # runs of a candidate are asked for together
    def _drawn(self, candidate: int) -> DrawnPoints | None:
        """Drives of a candidate; None without spread, or a scene, as its runs will say."""
        if not self._spreading.tolerances:
            return None
        try:
            scene = self.scene_of(candidate)
        except SceneError:
            return None
        spreading = self._spreading
        return DrawnPoints(scene, spreading.tolerances, spreading.draws, spreading.seed)

"""Checkpoints of a map: computed points on disk, from which interrupted work continues."""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from ab_sim.analysis.maps.refine import Point
from ab_sim.analysis.results import Results
from ab_sim.base.presentation import Progress
from ab_sim.scene.model import Scene

SAVE_INTERVAL = 20.0
"""Time between two checkpoints [s]: the most work that an interruption loses."""


class PointCheckpoint:
    """Computed values of a grid's points, saved periodically and at the end of the ``with`` block.

    Args:
        function: returns ``{"points": [[row, column, value], ...]}`` for a scene and numbers.
        scene, numbers: the arguments of ``function``: the key of the checkpoint.
    """

    def __init__(
        self, function: Callable[..., dict[str, Any]], scene: Scene, numbers: dict[str, Any]
    ) -> None:
        self._results, self._scene, self._numbers = Results(function), scene, numbers
        stored = self._results.find(scene, **numbers) or {"points": []}
        self._values: dict[Point, Any] = {(i, j): value for i, j, value in stored["points"]}
        self._on_disk = len(self._values)
        self._saved_at = time.monotonic()

    def __enter__(self) -> "PointCheckpoint":
        return self

    def __exit__(self, *_: object) -> None:
        self._save()

    def _save(self) -> None:
        if len(self._values) > self._on_disk:
            points = [[*point, value] for point, value in self._values.items()]
            self._results.keep({"points": points}, self._scene, **self._numbers)
        self._on_disk, self._saved_at = len(self._values), time.monotonic()

    def of(
        self,
        points: Sequence[Point],
        compute: Callable[[Sequence[Point]], Iterable[Any]],
        what: str,
        tell: Progress | None = None,
    ) -> list[Any]:
        """Return the values of points; missing values are computed.

        Args:
            points: row and column of each point.
            compute: function that returns JSON-able values of points, one by one.
            what: name of the work, for ``tell``.
            tell: progress callback; an exception in it ends the work; computed points are saved.
        """
        wanted = [point for point in points if point not in self._values]
        before = len(self._values)
        most = before + len(wanted)
        if tell is not None:
            tell(what, before, most)
        for point, value in zip(wanted, compute(wanted), strict=True):
            self._values[point] = value
            if time.monotonic() - self._saved_at > SAVE_INTERVAL:
                self._save()
            if tell is not None:
                tell(what, len(self._values), most)
        return [self._values[point] for point in points]

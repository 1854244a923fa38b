"""Points of a map that are known: kept on disk, so that work goes on where it was interrupted."""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from ab_sim.analysis.maps.refine import Point
from ab_sim.analysis.results import Results
from ab_sim.scene.model import Scene

OFTEN = 20.0
"""s between two times that what is known goes to the disk, so that no more than that is lost."""
Tell = Callable[[str, int, int], None]
"""Called with what is done now, how much is done, and of how much."""


class PointCheckpoint:
    """Computed values of a grid's points; on disk now and then, and when a ``with`` ends.

    Args:
        function: gives ``{"points": [[row, column, value], ...]}`` of a scene and numbers.
        scene, numbers: what the values follow from.
    """

    def __init__(
        self, function: Callable[..., dict[str, Any]], scene: Scene, numbers: dict[str, Any]
    ) -> None:
        self._results, self._scene, self._numbers = Results(function), scene, numbers
        known = self._results.find(scene, **numbers) or {"points": []}
        self._values: dict[Point, Any] = {(i, j): value for i, j, value in known["points"]}
        self._on_disk = len(self._values)
        self._kept_at = time.monotonic()

    def __enter__(self) -> "PointCheckpoint":
        return self

    def __exit__(self, *_: object) -> None:
        self._keep()

    def _keep(self) -> None:
        if len(self._values) > self._on_disk:
            points = [[*point, value] for point, value in self._values.items()]
            self._results.keep({"points": points}, self._scene, **self._numbers)
        self._on_disk, self._kept_at = len(self._values), time.monotonic()

    def of(
        self,
        points: Sequence[Point],
        compute: Callable[[Sequence[Point]], Iterable[Any]],
        what: str,
        tell: Tell | None = None,
    ) -> list[Any]:
        """Values of points, of which those that are not known yet are computed.

        Args:
            points: row, column of each.
            compute: their values, JSON-able, one by one.
            what: is done, for ``tell``.
            tell: what it raises ends the work; what was computed before is kept.
        """
        wanted = [point for point in points if point not in self._values]
        before = len(self._values)
        most = before + len(wanted)
        if tell is not None:
            tell(what, before, most)
        for point, value in zip(wanted, compute(wanted), strict=True):
            self._values[point] = value
            if time.monotonic() - self._kept_at > OFTEN:
                self._keep()
            if tell is not None:
                tell(what, len(self._values), most)
        return [self._values[point] for point in points]

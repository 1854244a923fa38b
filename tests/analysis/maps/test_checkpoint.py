"""Points of a map that were computed outlive whoever computed them."""

from collections.abc import Iterator, Sequence
from typing import Any

import pytest

from ab_sim.analysis import result_cache
from ab_sim.analysis.maps.refine import Point
from ab_sim.analysis.result_cache import PointCheckpoint, ResultCache
from ab_sim.scene import Scene
from tests.conftest import SceneMaker


def values(scene: Scene, seed: int) -> dict[str, Any]:
    """What is kept: here nobody but the test asks."""
    raise AssertionError("computed by the one who keeps it")


def test_they_are_on_disk_while_work_goes_on(
    scene: SceneMaker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(result_cache, "SAVE_INTERVAL", 0.0)
    made, numbers = scene(), {"seed": 1}
    seen: list[int] = []

    def compute(points: Sequence[Point]) -> Iterator[int]:
        for i, j in points:
            found = ResultCache(values).find(made, **numbers)
            seen.append(0 if found is None else len(found["points"]))
            yield 10 * i + j

    points = [(0, 0), (0, 1), (2, 3)]
    with PointCheckpoint(values, made, numbers) as known:
        assert known.of(points, compute, "points") == [0, 1, 23]
    assert seen == [0, 1, 2]

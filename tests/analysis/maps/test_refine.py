"""Refinement finds what a blind grid finds, but for islands that it says it may miss."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from ab_sim.analysis.maps.refine import Point, Refined, refined
from ab_sim.base.errors import InputError

SHAPE = (97, 130)
Label = Callable[[float, float], int]


def waves(x: float, y: float) -> int:
    return int(y > 0.5 + 0.3 * math.sin(7.0 * x)) + 2 * int(x > 0.3 + 0.1 * math.cos(5.0 * y))


def ring(x: float, y: float) -> int:
    return int(0.15 < math.hypot(x - 0.5, y - 0.5) < 0.2)


def tongue(x: float, y: float) -> int:
    """Thinner than any coarse cell but at its root, and far longer."""
    return int(x < 0.1 or (x < 0.95 and abs(y - 0.43 - 0.2 * x) < 0.006))


def spiral(x: float, y: float) -> int:
    angle = math.atan2(y - 0.5, x - 0.5)
    return int(math.sin(angle + 25.0 * math.hypot(x - 0.5, y - 0.5)) > 0.8)


def run(label: Label, coarse: int, shape: Point = SHAPE) -> tuple[Refined, np.ndarray, int]:
    """Refined; by a blind grid; and how many points were asked for, none of them twice."""
    asked: list[Point] = []

    def at(point: Point) -> int:
        return label(*(k / max(1, n - 1) for k, n in zip(point, shape, strict=True)))

    def verdicts(points: Sequence[Point]) -> list[int]:
        asked.extend(points)
        return [at(point) for point in points]

    found = refined(verdicts, shape, coarse)
    assert len(asked) == len({*asked}) == found.computed.sum()
    blind = np.array([[at((i, j)) for j in range(shape[1])] for i in range(shape[0])])
    return found, blind, len(asked)


@pytest.mark.parametrize("label", [waves, ring, tongue, spiral])
@pytest.mark.parametrize("coarse", [2, 4, 8])
def test_all_of_a_map_whose_parts_are_touched_is_found(label: Label, coarse: int) -> None:
    found, blind, asked = run(label, coarse)
    np.testing.assert_array_equal(found.labels, blind)
    np.testing.assert_array_equal(found.labels[found.computed], blind[found.computed])
    assert asked < 0.75 * blind.size


def test_a_plain_map_costs_its_coarse_points_only() -> None:
    _, _, asked = run(lambda x, y: 3, 8)
    assert asked == 13 * 18


def test_both_sides_of_every_border_are_computed() -> None:
    found, _, _ = run(waves, 8)
    for axis in (0, 1):
        borders = np.diff(found.labels, axis=axis) != 0
        sides = np.delete(found.computed, -1, axis), np.delete(found.computed, 0, axis)
        assert (sides[0] & sides[1])[borders].all()


@pytest.mark.parametrize("at", [(20, 30), (41, 57), (80, 120)])
def test_an_island_of_the_coarse_spacing_is_found_and_found_whole(at: Point) -> None:
    def island(i: int, j: int) -> int:
        return int(at[0] <= i < at[0] + 8 and at[1] <= j < at[1] + 8)

    shape = SHAPE
    found = refined(lambda points: [island(*p) for p in points], shape, 8)
    assert (found.labels == 1).sum() == 64


def test_a_smaller_one_may_be_missed_and_is_not_by_every_point() -> None:
    def island(i: int, j: int) -> int:
        return int(17 <= i < 24 and 25 <= j < 32)

    missed = refined(lambda points: [island(*p) for p in points], SHAPE, 8)
    whole = refined(lambda points: [island(*p) for p in points], SHAPE, 1)
    assert missed.labels.sum() == 0 and whole.labels.sum() == 49 and whole.computed.all()


@pytest.mark.parametrize("shape", [(2, 2), (2, 50), (9, 3)])
def test_grids_smaller_than_the_spacing(shape: Point) -> None:
    found, blind, _ = run(lambda x, y: int(x > y), 8, shape)
    assert found.labels.shape == shape
    corners = [found.labels[i, j] == blind[i, j] for i in (0, -1) for j in (0, -1)]
    assert all(corners)


@pytest.mark.parametrize("coarse", [0, -8, 3, 12])
def test_spacings_that_cannot_be_halved_are_refused(coarse: int) -> None:
    with pytest.raises(InputError, match=f"^coarse = {coarse}: .*power of two"):
        refined(lambda points: [0] * len(points), SHAPE, coarse)

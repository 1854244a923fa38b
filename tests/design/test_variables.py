"""What varies in a sweep, as it is written."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ab_sim.base.errors import InputError
from ab_sim.design.points import (
    DesignPoints,
    GridPoints,
    ListedValues,
    Range,
    points_of,
    range_,
    spaced,
    values,
    variable_of,
)

MASS, DRAG = "balls.mass", "effects.viscous_drag.coefficient"


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("balls.mass=0.001..0.003:3", (0.001, 0.002, 0.003)),
        ("balls.mass = 1 g..3g:3", (0.001, 0.002, 0.003)),
        ("balls.mass=1..3 g:3", (0.001, 0.002, 0.003)),
        ("balls.mass=log:1e-4..1e-2:3", (1e-4, 1e-3, 1e-2)),
        ("balls.mass=1 g,2000 mg,0.003 kg", (0.001, 0.002, 0.003)),
        ("balls.mass=1,2,3 g", (0.001, 0.002, 0.003)),
        ("balls.mass=[1, 2, 3 g]", (0.001, 0.002, 0.003)),
        ("balls.count=1..4:4", (1, 2, 3, 4)),
        ("balls.count=1..9:3", (1, 5, 9)),
        ("solver.stepper=rk4, rk8", ("rk4", "rk8")),
        ("start.ball_angles=[[0, 1], [2, 3]]", ([0, 1], [2, 3])),
        ("profile.segments=[[{hold: 1}], [{hold: 2}]]", ([{"hold": 1}], [{"hold": 2}])),
    ],
)
def test_values_as_they_are_written(text: str, values: tuple[object, ...]) -> None:
    found = variable_of(text)
    assert isinstance(found, ListedValues) and found.key == text.partition("=")[0].strip()
    if isinstance(values[0], float):
        assert np.allclose(found.values, values, rtol=1e-14, atol=0.0)
    else:
        assert found.values == values
        assert [type(each) for each in found.values] == [type(each) for each in values]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("balls.mass", "must be KEY="),
        ("balls.mass=", "must be KEY="),
        ("=1..2:3", "must be KEY="),
        ("balls.mas=1..2:3", "did you mean 'balls.mass'"),
        ("balls.mass=1..2:x", "'x' is not a number"),
        ("balls.mass=1..2:0", "0 values: must be from 2"),
        ("balls.mass=1..2:9999999", "must be from 2 to 1000000"),
        ("balls.mass=2..1:3", "the lower one first"),
        ("balls.mass=1..nan:3", "finite"),
        ("balls.mass=1..1e999:3", "finite"),
        ("balls.mass=a..2:3", "'a' is not a number"),
        ("balls.mass=1 mm..2 mm:3", "is a length"),
        ("balls.mass=1 g..3:3", "'3' must have a unit"),
        ("balls.mass=1 g,0.002", "'0.002' must have a unit"),
        ("balls.mass=log:0..2:3", "must be above 0"),
        ("balls.count=1..2.5:2", "must be whole numbers"),
        ("balls.count=1..2:3", "3 values: must be from 2"),
        ("balls.mass=nan,1", "balls.mass: nan: must be finite"),
        ("start.ball_angles=[[0, .nan]]", "must be finite"),
        (f"balls.mass=1,1{'0' * 50}", "0: must be finite; whole "),
        (
            f"start.ball_angles=[[0, -1{'0' * 50}]]",
            "numbers must lie within 64 bits",
        ),
        ("balls.mass=1,1", "is given twice"),
        ("balls.mass=[1", "its values"),
    ],
)
def test_what_cannot_be_meant_is_said(text: str, words: str) -> None:
    with pytest.raises(InputError) as raised:
        variable_of(text)
    assert words in str(raised.value), raised.value


def test_an_int_beyond_all_floats_is_refused() -> None:
    with pytest.raises(InputError, match="from 1 to 1.00000e\\+400: .*finite"):
        range_(MASS, 1, 10**400)
    with pytest.raises(InputError, match="balls.mass: 1000.*000: .* within 64 bits"):
        values(MASS, [10**400, 1])


def test_a_grid_has_all_combinations_the_last_key_fastest() -> None:
    grid = points_of([variable_of(f"{MASS}=1,2"), variable_of(f"{DRAG}=3,4,5")], None)
    assert isinstance(grid, GridPoints) and grid.shape == (2, 3) and len(grid) == 6
    assert [grid.at(run) for run in range(6)] == [(m, d) for m in (1, 2) for d in (3, 4, 5)]


@pytest.mark.parametrize("log", [False, True])
def test_the_fraction_of_a_range_is_that_of_its_value(log: bool) -> None:
    shares = np.array([0.0, 0.3, 1.0])
    range_ = Range(DRAG, 0.01, 100.0, log)
    assert [range_.share(value) for value in range_.at(shares)] == pytest.approx(shares, abs=1e-12)


@pytest.mark.parametrize("design", ["sobol:64", "lhs:64"])
def test_a_design_fills_its_ranges_evenly(design: str) -> None:
    ranges = [
        Range(MASS, 1e-3, 2e-3),
        Range(DRAG, 0.01, 100.0, log=True),
        Range("balls.count", 1, 4, whole=True),
    ]
    found = points_of(ranges, design, seed=3)
    assert isinstance(found, DesignPoints) and len(found) == 64
    columns = np.array([found.at(run) for run in range(64)]).T
    shares = [(columns[0] - 1e-3) / 1e-3, np.log(columns[1] / 0.01) / np.log(1e4)]
    for each in shares:  # one of 64 in each 64th, as both designs have it
        assert sorted(np.floor(each * 64).astype(int)) == list(range(64))
    assert np.unique(columns[2], return_counts=True)[1].tolist() == [16, 16, 16, 16]
    assert type(found.at(0)[2]) is int
    again, other = points_of(ranges, design, seed=3), points_of(ranges, design, seed=4)
    assert [again.at(run) for run in range(64)] == [found.at(run) for run in range(64)]
    assert other.at(0) != found.at(0) and other.report() != found.report()


@pytest.mark.parametrize(
    ("texts", "design", "words"),
    [
        ([], None, "nothing varies"),
        ([f"{MASS}=1,2", f"{MASS}=3,4"], None, "varies twice"),
        ([f"{MASS}=1..2"], None, "needs a number of values"),
        ([f"{MASS}=1,2"], "sobol:8", "a design takes ranges"),
        ([f"{MASS}=1..2"], "sobol:9", "must be a power of 2"),
        ([f"{MASS}=1..2"], "grid:9", "must be sobol:COUNT"),
        ([f"{MASS}=1..2"], "lhs:0", "0 runs"),
        ([f"{MASS}=1..2:10000", f"{DRAG}=1..2:10000"], None, "100000000 runs: must be"),
    ],
)
def test_points_that_cannot_be_are_refused(
    texts: list[str], design: str | None, words: str
) -> None:
    with pytest.raises(InputError) as raised:
        points_of([variable_of(text) for text in texts], design)
    assert words in str(raised.value)


@given(low=st.floats(1e-9, 1e3), ratio=st.floats(1.001, 1e6), count=st.integers(2, 50))
def test_both_ends_are_among_the_values(low: float, ratio: float, count: int) -> None:
    for log in (False, True):
        found = spaced(Range(MASS, low, low * ratio, log), count).values
        assert (found[0], found[-1]) == (low, low * ratio) and len(found) == count
        assert all(a < b for a, b in zip(found, found[1:], strict=False))

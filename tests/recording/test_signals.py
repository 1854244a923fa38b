"""What vibration is made of, against scipy's spectra and against waves that are known."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import periodogram

from ab_sim.record.recording.signals import FrameRate, SlidingWindows, once_per_turn, rms, spectrum

Array = NDArray[np.float64]


def rows(count: int, step: float = 1e-4) -> Array:
    """A table whose third column tells rows apart; every so often one is missing."""
    table = np.column_stack(
        [np.arange(count), np.arange(count) * step, np.random.default_rng(2).normal(size=count)]
    )
    return table[np.arange(count) % 997 != 5]


def cut(table: Array, sizes: list[int]) -> list[Array]:
    ends = np.cumsum(np.resize(sizes, len(table)))
    return [part for part in np.split(table, ends[ends < len(table)]) if len(part)]


@pytest.mark.parametrize("sizes", [[1, 90], [7, 1, 300], [4000], [99_999]])
def test_windows_do_not_depend_on_how_rows_come_in(sizes: list[int]) -> None:
    table = rows(12_000)
    windows = SlidingWindows(0.25, 0.02)
    found = [window for part in cut(table, sizes) for window in windows.of(part)]
    ns = np.rint(table[:, 1] * 1e9).astype(int)
    ends = range(20_000_000, int(ns[-1]) + 1, 20_000_000)
    expected = [table[(ns >= end - 250_000_000) & (ns < end)] for end in ends]
    assert len(found) == len(expected) == 59
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_there_is_no_window_of_times_without_rows() -> None:
    table = rows(5000)
    table[2000:, 1] += 1e5
    windows = SlidingWindows(0.25, 0.02)
    found = [window for part in cut(table, [700]) for window in windows.of(part)]
    assert sum(window[-1, 1] < 1.0 for window in found) == 11
    assert all(np.ptp(window[:, 1]) < 0.25 for window in found)


def test_there_is_no_window_where_time_runs_back() -> None:
    table = rows(5000)
    table[2000:, 1] -= 0.05
    windows = SlidingWindows(0.25, 0.02)
    found = [window for part in cut(table, [70]) for window in windows.of(part)]
    assert found and all((np.diff(window[:, 1]) > 0.0).all() for window in found)


@pytest.mark.parametrize("sizes", [[1, 2], [7, 1, 300], [10_000]])
def test_decimation_keeps_the_first_row_of_each_period(sizes: list[int]) -> None:
    table, decimation = rows(3000), FrameRate(1e-3)
    kept = np.concatenate([decimation.of(part) for part in cut(table, sizes)])
    ms = np.rint(table[:, 1] * 1e9).astype(int) // 1_000_000
    expected = [int(np.flatnonzero(ms == k)[0]) for k in range(300)]
    np.testing.assert_array_equal(kept, table[expected])


def test_rms_weighs_time_and_not_rows() -> None:
    """Of a sine, half of it seen 25 times as often."""
    time = np.concatenate([np.linspace(0.0, 0.5, 10_001), np.linspace(0.5, 1.0, 401)[1:]])
    wave = np.column_stack([3.0 * np.sin(20 * np.pi * time), 0.0 * time])
    assert rms(time, wave) == pytest.approx(3.0 / np.sqrt(2.0), rel=1e-3)
    even = np.random.default_rng(0).normal(size=(500, 2))
    expected = np.sqrt(np.mean(np.sum(even**2, axis=1)))
    assert rms(np.arange(500) * 1e-3, even) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("turns", [2.0, 4.3, 31.7])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_once_per_turn_is_told_from_another_order(turns: float, sense: float) -> None:
    """A wave of order 1, elliptic, beside one of order 3 and a constant."""
    angle = sense * np.linspace(0.3, 0.3 + 2 * np.pi * turns * (1 + 1e-9), 2500)
    first = np.column_stack([4.0 * np.cos(angle + 0.7), 1.5 * np.sin(angle)])
    other = np.column_stack([0.5 * np.cos(3 * angle - 1.0), 2.0 + 0.0 * angle])
    found = once_per_turn(angle, first + other)
    assert found is not None
    assert found[0] == pytest.approx(np.sqrt((16 + 2.25) / 2), rel=1e-5)
    assert found[1] == pytest.approx(np.sqrt(0.125 + 4.0), rel=1e-5)


def test_once_per_turn_at_a_changing_speed_and_of_any_other_frequency() -> None:
    """From 60 to 110 rad/s; a vibration of 23.7 Hz beside, which fits no revolution."""
    time = np.arange(0.0, 0.5, 1e-3)
    angle = 60.0 * time + 50.0 * time**2
    first = np.column_stack([2.0 * np.cos(angle), 2.0 * np.sin(angle)])
    alone = once_per_turn(angle, first)
    assert alone is not None
    assert alone[0] == pytest.approx(2.0, rel=2e-4) and alone[1] < 2e-3
    other = 0.8 * np.sin(2 * np.pi * 23.7 * time)[:, None] * [1.0, 0.0]
    both = once_per_turn(angle, first + other)
    assert both is not None
    assert both[0] == pytest.approx(2.0, rel=0.05)
    assert both[1] == pytest.approx(0.8 / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize(
    "angle",
    [
        np.linspace(0.0, 12.0, 100),  # less than two turns
        np.zeros(100),
        30.0 * np.sin(np.linspace(0.0, 3.0, 500)),  # there and back
        np.arange(50) * 4.0,  # less than two rows in a turn
        np.array([1.0]),
        np.full(100, np.nan),
    ],
)
def test_once_per_turn_is_not_told_where_it_cannot_be(angle: Array) -> None:
    assert once_per_turn(angle, np.ones((len(angle), 2))) is None


@pytest.mark.parametrize("count", [500, 501])
def test_spectrum_is_scipys(count: int) -> None:
    vectors = np.random.default_rng(5).normal(size=(count, 3)) + [0.0, 5.0, 0.0]
    frequencies, sizes = spectrum(1e-3, vectors)
    options = {"window": "hann", "scaling": "spectrum", "detrend": "constant", "axis": 0}
    expected, power = periodogram(vectors, fs=1e3, **options)
    np.testing.assert_allclose(frequencies, expected, rtol=1e-12)
    np.testing.assert_allclose(sizes, np.sqrt(power.sum(axis=1)), rtol=1e-9, atol=1e-12)


def test_a_circle_has_the_size_of_its_radius() -> None:
    time = np.arange(500) * 1e-3
    turning = 7.0 * np.column_stack([np.cos(2 * np.pi * 40 * time), np.sin(2 * np.pi * 40 * time)])
    frequencies, sizes = spectrum(1e-3, turning)
    assert frequencies[np.argmax(sizes)] == 40.0
    assert sizes.max() == pytest.approx(7.0)
    assert rms(time, turning) == pytest.approx(7.0)

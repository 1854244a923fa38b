"""Spectra of known sines, piece by piece, against scipy."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.signal import welch

from ab_sim.show.blocks import (
    Envelope,
    OncePerTurn,
    PowerSpectrum,
    Waterfall,
    WelchSegments,
)

RATE = 1000.0


def blocks(columns: Any, size: int = 333) -> Any:
    for first in range(0, len(columns), size):
        yield columns[first : first + size]


def test_the_spectrum_is_welchs() -> None:
    """Of two axes: the sum of both; to rounding."""
    time = np.arange(20_000) / RATE
    noise = np.random.default_rng(0).normal(size=(2, len(time)))
    axes = np.column_stack([3 + 2 * np.sin(2 * math.pi * 50 * time), np.cos(900 * time)]) + noise.T
    spectrum = PowerSpectrum(len(time))
    for part in blocks(np.column_stack([np.arange(len(time)), time, axes])):
        spectrum.take(part[:, 0], part[:, 1], part[:, 2:])
    frequencies, density = welch(axes, RATE, nperseg=spectrum.length, axis=0)
    np.testing.assert_allclose(spectrum.frequencies, frequencies, rtol=1e-12)
    np.testing.assert_allclose(spectrum.density, density.sum(axis=1), rtol=1e-9)
    # Parseval: the sine has half of its amplitude's square, around 50 Hz.
    near = np.abs(frequencies - 50) < 5
    power = spectrum.density[near].sum() * frequencies[1]
    assert power == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("size", [1, 7, 64, 1000])
def test_segments_do_not_depend_on_blocks(size: int) -> None:
    rows = np.column_stack([np.arange(1000), np.random.default_rng(0).normal(size=1000)])
    segments = WelchSegments(64, 48)
    found = [each for part in blocks(rows, size) for each in segments.take(part)]
    assert [each[0, 0] for each in found] == list(range(0, 1000 - 63, 48))
    for each in found:
        np.testing.assert_array_equal(each, rows[int(each[0, 0]) :][:64])


@pytest.mark.parametrize("size", [1, 100, 5000])
def test_no_segment_lies_across_a_gap(size: int) -> None:
    steps = np.concatenate([np.arange(100), np.arange(130, 500), np.arange(500, 3000, 10)])
    segments = WelchSegments(64, 64)
    found = [each for part in blocks(steps[:, None], size) for each in segments.take(part)]
    assert segments.stride == 1.0
    for each in found:
        np.testing.assert_array_equal(np.diff(each[:, 0]), np.ones(63))
    assert found[0][0, 0] == 0 and [each[0, 0] for each in found[1:]] == [130, 194, 258, 322, 386]


def test_the_waterfall_has_an_amplitude_where_it_was() -> None:
    """A run-up of 40 s to 300 rad/s; an amplitude of 2 turns with the spindle, 0.5 at 200 Hz."""
    time = np.arange(40_000) / RATE
    speed = 7.5 * time
    angle = 3.75 * time**2
    axes = 2 * np.cos(angle) + 0.5 * np.cos(2 * math.pi * 200 * time)
    fall = Waterfall(len(time), RATE, (0.0, 300.0))
    for part in blocks(np.column_stack([np.arange(len(time)), time, speed, axes])):
        fall.take(part[:, 0], part[:, 1], part[:, 2], part[:, 3:])
    assert fall.amplitudes.shape == (80, len(fall.frequencies))
    fixed = fall.amplitudes[:, np.argmin(np.abs(fall.frequencies - 200))]
    assert np.nanmax(fixed) == pytest.approx(0.5, rel=0.1)
    middles = 0.5 * (fall.edges[1:] + fall.edges[:-1])
    for row in range(20, 80, 10):
        below = fall.frequencies < 100
        top = fall.frequencies[below][np.nanargmax(fall.amplitudes[row, below])]
        assert top == pytest.approx(middles[row] / (2 * math.pi), abs=3.0)


def test_once_per_turn_is_a_share_of_the_power() -> None:
    """Amplitude 3 with the spindle, 1 against it, 2 at another frequency, on a constant 7."""
    time = np.arange(10_000) / RATE
    angle = 2 * math.pi * 30 * time
    z = 3 * np.exp(1j * angle) + np.exp(1j * (1 - angle)) + 2 * np.exp(2j * math.pi * 77 * time)
    axes = np.column_stack([z.real + 7, z.imag])
    found = OncePerTurn()
    for part in blocks(np.column_stack([angle, axes])):
        found.take(part[:, 0], part[:, 1:])
    assert found.share == pytest.approx((9 + 1) / (9 + 1 + 4), rel=1e-9)
    assert found.rms == pytest.approx(math.sqrt(14), rel=1e-9)


def test_once_per_turn_needs_a_turn() -> None:
    found = OncePerTurn()
    assert found.rms is None and found.share is None
    found.take(np.linspace(0, 6, 100), np.ones((100, 2)))
    assert found.share is None and found.rms == 0.0


@pytest.mark.parametrize("size", [1, 37, 100_000])
def test_curves_keep_every_peak(size: int) -> None:
    time = np.arange(50_000) / RATE
    values = np.sin(time)
    values[[12_345, 40_001]] = [50.0, -30.0]
    envelope = Envelope(["x"], len(time))
    for part in blocks(np.column_stack([time, values]), size):
        envelope.take(part[:, 0], part[:, 1:])
    at, shown = envelope.curve("x")
    assert len(at) <= 4000 and np.all(np.diff(at) > 0)
    np.testing.assert_array_equal(shown, values[np.rint(at * RATE).astype(int)])
    assert {50.0, -30.0} <= set(shown)


def test_curves_of_few_samples_are_the_samples() -> None:
    envelope = Envelope(["x"], 100)
    time, values = np.arange(100.0), np.random.default_rng(0).normal(size=(100, 1))
    values[7] = np.nan
    envelope.take(time, values)
    at, shown = envelope.curve("x")
    np.testing.assert_array_equal(at, np.delete(time, 7))
    np.testing.assert_array_equal(shown, np.delete(values[:, 0], 7))

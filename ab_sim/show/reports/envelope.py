"""Curves of many samples, reduced to few points with all peaks."""

from collections.abc import Sequence

import numpy as np

POINTS = 2000
"""Number of bins of a curve, each drawn as its least and its largest sample."""


class Envelope:
    """Least and largest sample of each channel in bins of equal numbers of samples.

    If there are at most as many samples as bins, the curves contain all samples.

    Args:
        channels: names of the channels.
        count: total number of samples.
        bins: largest number of bins.
    """

    def __init__(self, channels: Sequence[str], count: int, bins: int = POINTS) -> None:
        self.channels = tuple(channels)
        self._count = max(count, 1)
        self._bins = min(bins, self._count)
        shape = (2, self._bins, len(self.channels))
        self._times, self._values = np.full(shape, np.nan), np.full(shape, np.nan)
        self._done = 0

    def take(self, time: np.ndarray, values: np.ndarray) -> None:
        """Add samples.

        Args:
            time: times of the samples [s], shape (samples,).
            values: samples, shape (samples, channels); values that are not finite are left out.
        """
        bins = (self._done + np.arange(len(time))) * self._bins // self._count
        self._done += len(time)
        edges = np.flatnonzero(np.diff(bins, prepend=-1, append=-1))
        for begin, end in zip(edges[:-1], edges[1:], strict=True):
            if bins[begin] < self._bins:  # otherwise there are more samples than announced
                self._merge(int(bins[begin]), time[begin:end], values[begin:end])

    def curve(self, channel: str) -> tuple[np.ndarray, np.ndarray]:
        """Return times [s] and values of a channel, at most two per bin, in order."""
        at = self.channels.index(channel)
        times, values = self._times[:, :, at], self._values[:, :, at]
        order = np.argsort(times, axis=0)
        times = np.take_along_axis(times, order, 0).T.ravel()
        values = np.take_along_axis(values, order, 0).T.ravel()
        there = np.isfinite(times) & np.isfinite(values)
        # A bin with one sample contains it twice.
        there[1:] &= ~((times[1:] == times[:-1]) & (values[1:] == values[:-1]))
        return times[there], values[there]

    def _merge(self, bin_: int, time: np.ndarray, values: np.ndarray) -> None:
        all_times = np.column_stack([self._times[:, bin_].T, np.tile(time, (values.shape[1], 1))])
        all_values = np.column_stack([self._values[:, bin_].T, values.T])
        finite = np.isfinite(all_values)
        for row, (pick, none) in enumerate(((np.argmin, np.inf), (np.argmax, -np.inf))):
            at = pick(np.where(finite, all_values, none), axis=1)[:, None]
            self._times[row, bin_] = np.take_along_axis(all_times, at, 1)[:, 0]
            self._values[row, bin_] = np.take_along_axis(all_values, at, 1)[:, 0]

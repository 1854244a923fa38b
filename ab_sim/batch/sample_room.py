"""Where the samples of many runs are kept."""

import numpy as np

_BLOCK = 2**21
"""Numbers, 16 MB: memory comes in huge pages then, which take a third of the time to be had."""


class SampleRoom:
    """Room for samples, got for many runs at a time.

    Args:
        runs: how many there are to come.
        shape: of the samples of one, (samples, channels).
    """

    def __init__(self, runs: int, shape: tuple[int, int]) -> None:
        self._left, self._shape = runs, shape
        self._block, self._used = np.empty((0, *shape)), 0

    def take(self, runs: int) -> np.ndarray:
        """Room for some more, shape (runs, samples, channels); its content is arbitrary."""
        if self._used + runs > len(self._block):
            fit = min(_BLOCK // max(1, self._shape[0] * self._shape[1]), self._left)
            self._block, self._used = np.empty((max(runs, fit), *self._shape)), 0
        self._used, self._left = self._used + runs, self._left - runs
        return self._block[self._used - runs : self._used]

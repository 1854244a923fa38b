"""Statistics of durations: a histogram in constant memory, and the stages of a wake-up."""

import math
import time
from collections.abc import Callable

import numpy as np

SHORTEST = 1e-6
"""Upper bound of the first class [s]; shorter durations count as this one."""
PER_DECADE = 40
"""Number of classes per decade; a quantile is too long by at most 6 %."""
DECADES = 9


class DurationHistogram:
    """Counts durations [s] in classes of equal ratio; the longest duration is exact."""

    def __init__(self) -> None:
        # A list, because its entries are incremented ten times as fast as those of an array.
        self._counts = [0] * (PER_DECADE * DECADES + 1)
        self.count = 0
        self.worst = 0.0

    def add(self, duration: float) -> None:
        """Count a duration [s]."""
        ratio = max(duration, SHORTEST) / SHORTEST
        place = math.ceil(PER_DECADE * math.log10(ratio) - 1e-9)
        self._counts[min(place, len(self._counts) - 1)] += 1
        self.count += 1
        self.worst = max(self.worst, duration)

    def quantile(self, share: float) -> float:
        """Return the quantile of the durations for a share from 0 to 1 [s]; 0 without durations."""
        if not self.count:
            return 0.0
        place = int(np.searchsorted(np.cumsum(self._counts), math.ceil(share * self.count)))
        if place == len(self._counts) - 1:
            return self.worst
        return min(SHORTEST * 10.0 ** (place / PER_DECADE), self.worst)

    def values(self, what: str) -> dict[str, str]:
        """Return quantiles and maximum for the diagnostics; ``what`` begins their names."""
        if not self.count:
            return {}
        shares = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}
        figures = {name: self.quantile(share) for name, share in shares.items()}
        return {
            f"{what}, {name} [s]": f"{figure:.6f}"
            for name, figure in {**figures, "worst": self.worst}.items()
        }


class StageTimer:
    """Measures the durations of the stages of a wake-up.

    Args:
        names: names of the stages.
        clock: function that returns the time [ns].
    """

    def __init__(self, *names: str, clock: Callable[[], int] = time.perf_counter_ns) -> None:
        self._names, self._clock = names, clock
        self._mark = 0
        self._clear()

    def begin(self) -> None:
        """Start to measure the next stage now."""
        self._mark = self._clock()

    def end(self, name: str) -> None:
        """End a stage and start the next one."""
        now = self._clock()
        self._counts[name] += 1
        self._totals[name] += now - self._mark
        self._longest[name] = max(self._longest[name], now - self._mark)
        self._mark = now

    def values(self) -> dict[str, str]:
        """Return mean and longest duration of each stage since the last call."""
        values = {}
        for name in self._names:
            mean = 1e-9 * self._totals[name] / max(self._counts[name], 1)
            values[f"{name}, mean [s]"] = f"{mean:.7f}"
            values[f"{name}, longest [s]"] = f"{1e-9 * self._longest[name]:.7f}"
        self._clear()
        return values

    def _clear(self) -> None:
        self._counts = dict.fromkeys(self._names, 0)
        self._totals = dict.fromkeys(self._names, 0)
        self._longest = dict.fromkeys(self._names, 0)

"""Durations of the stages of a wake-up."""

import time
from collections.abc import Callable


class StageTimer:
    """Measures the durations of the stages of a wake-up.

    Args:
        names: names of the stages.
        clock: returns the time [ns].
    """

    def __init__(self, *names: str, clock: Callable[[], int] = time.perf_counter_ns) -> None:
        self._names, self._clock = names, clock
        self._mark = 0
        self._clear()

    def begin(self) -> None:
        """Start the next stage."""
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

"""Ticks of a period by the steady clock, and those that were lost; no ROS, and no clock."""

import math

STILL = 0.1
"""s without a tick, beyond which there is something to warn of."""


class Ticker:
    """Says when a tick is due. Ticks stay on their grid; of several that are due, one is made.

    Args:
        period: between two ticks [s].
        now: the time [s].
    """

    def __init__(self, period: float, now: float) -> None:
        self.period = period
        self.lost = 0
        """Ticks that were not made in time: a later one stood for them."""
        self._origin, self._next, self._last, self._gap = now, 1, now, 0.0

    def wait(self, now: float) -> float:
        """Time until the next tick [s]."""
        return max(self._origin + self._next * self.period - now, 0.0)

    def due(self, now: float) -> bool:
        """Return whether a tick is due now; a due tick counts as made."""
        passed = math.floor((now - self._origin) / self.period + 1e-9)
        if passed < self._next:
            return False
        self.lost += passed - self._next
        self._next = passed + 1
        self._gap, self._last = max(self._gap, now - self._last), now
        return True

    def warning(self) -> str:
        """Text on the longest time without a tick since the last call; empty if it was short."""
        gap, self._gap = self._gap, 0.0
        if gap <= max(STILL, 2.0 * self.period):
            return ""
        return f"no tick for {gap:.3g} s: this process was kept from running"

"""Probability distributions, sampled by the quantile function of uniform numbers."""

import math
from typing import NamedTuple

import numpy as np

LEAST_LEFT = 1e-6
"""Least probability between the limits; for less, rounding spoils the quantiles."""


class Normal(NamedTuple):
    """Normal distribution, truncated at limits and renormalised."""

    mean: float
    deviation: float
    low: float = -math.inf
    high: float = math.inf

    def left(self) -> float:
        """Return the probability between the limits before truncation, 0 to 1."""
        low, high = self._ends()
        return high - low

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles.

        Args:
            shares: probabilities above 0 and below 1, shape (n,).
        """
        from scipy.special import ndtri

        low, high = self._ends()
        drawn = self.mean + self.deviation * ndtri(low + shares * (high - low))
        return np.clip(drawn, self.low, self.high)

    def _ends(self) -> tuple[float, float]:
        from scipy.special import ndtr

        ends = [(limit - self.mean) / self.deviation for limit in (self.low, self.high)]
        return float(ndtr(ends[0])), float(ndtr(ends[1]))


class LogNormal(NamedTuple):
    """Log-normal distribution, reduced by ``shift``, truncated at limits."""

    median: float
    log_deviation: float
    low: float = -math.inf
    high: float = math.inf
    shift: float = 0.0
    """Amount subtracted from the value; 1 for a relative deviation."""

    def left(self) -> float:
        """Return the probability between the limits, see ``Normal``."""
        return self._logarithm().left()

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles, see ``Normal``."""
        drawn = np.exp(self._logarithm().at(shares)) - self.shift
        return np.clip(drawn, self.low, self.high)

    def _logarithm(self) -> Normal:
        low, high = (
            math.log(limit + self.shift) if limit + self.shift > 0 else -math.inf
            for limit in (self.low, self.high)
        )
        return Normal(math.log(self.median), self.log_deviation, low, high)


class Uniform(NamedTuple):
    """Uniform distribution between two limits."""

    low: float
    high: float

    def left(self) -> float:
        """Return the probability between the limits, see ``Normal``."""
        return 1.0

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles, see ``Normal``."""
        return self.low + shares * (self.high - self.low)


class Discrete(NamedTuple):
    """Choice from a list of values with equal probability; repeated values count repeatedly."""

    choices: int

    def left(self) -> float:
        """Return the probability between the limits, see ``Normal``."""
        return 1.0

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return indices in the list of values; arguments as for ``Normal``."""
        return np.floor(shares * self.choices).astype(np.int64)


class Loading(NamedTuple):
    """Multiple, of either sign, of a standard normal number shared with other tolerances."""

    size: float

    def left(self) -> float:
        """Return the probability between the limits, see ``Normal``."""
        return 1.0

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles, see ``Normal``."""
        return self.size * Normal(0.0, 1.0).at(shares)


Distribution = Normal | LogNormal | Uniform | Discrete | Loading

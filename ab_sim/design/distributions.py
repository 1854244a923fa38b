"""Distributions of numbers, drawn by turning a share between 0 and 1 into its quantile."""

import math
from typing import NamedTuple

import numpy as np

LEAST_LEFT = 1e-6
"""Of a distribution between its limits: rounding spoils the quantiles of less."""


class Normal(NamedTuple):
    """Bell-shaped, cut off at limits and scaled up between them."""

    mean: float
    deviation: float
    low: float = -math.inf
    high: float = math.inf

    def left(self) -> float:
        """Which part of it lies between the limits, 0 to 1."""
        low, high = self._ends()
        return high - low

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Quantiles.

        Args:
            shares: above 0 and below 1, shape (n,).
        """
        from scipy.special import ndtri

        low, high = self._ends()
        drawn = self.mean + self.deviation * ndtri(low + shares * (high - low))
        return np.clip(drawn, self.low, self.high)

    def _ends(self) -> tuple[float, float]:
        from scipy.special import ndtr

        ends = [(each - self.mean) / self.deviation for each in (self.low, self.high)]
        return float(ndtr(ends[0])), float(ndtr(ends[1]))


class LogNormal(NamedTuple):
    """Of positive numbers whose logarithm is normally distributed, less ``shift``."""

    median: float
    log_deviation: float
    low: float = -math.inf
    high: float = math.inf
    shift: float = 0.0
    """1 for a deviation from 1 as a share."""

    def left(self) -> float:
        """As of ``Normal``."""
        return self._logarithm().left()

    def at(self, shares: np.ndarray) -> np.ndarray:
        """As of ``Normal``."""
        drawn = np.exp(self._logarithm().at(shares)) - self.shift
        return np.clip(drawn, self.low, self.high)

    def _logarithm(self) -> Normal:
        low, high = (
            math.log(each + self.shift) if each + self.shift > 0 else -math.inf
            for each in (self.low, self.high)
        )
        return Normal(math.log(self.median), self.log_deviation, low, high)


class Uniform(NamedTuple):
    """The same chance everywhere between two ends."""

    low: float
    high: float

    def left(self) -> float:
        """As of ``Normal``."""
        return 1.0

    def at(self, shares: np.ndarray) -> np.ndarray:
        """As of ``Normal``."""
        return self.low + shares * (self.high - self.low)


class Discrete(NamedTuple):
    """Some values of any kind with the same chance each; one given twice has twice the chance."""

    choices: int

    def left(self) -> float:
        """As of ``Normal``."""
        return 1.0

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Places in the list of values, counted from 0; else as of ``Normal``."""
        return np.floor(shares * self.choices).astype(np.int64)


class Loading(NamedTuple):
    """A multiple, of either sign, of a standard normal number that others share."""

    size: float

    def left(self) -> float:
        """As of ``Normal``."""
        return 1.0

    def at(self, shares: np.ndarray) -> np.ndarray:
        """As of ``Normal``."""
        return self.size * Normal(0.0, 1.0).at(shares)


Distribution = Normal | LogNormal | Uniform | Discrete | Loading

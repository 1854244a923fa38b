"""Functions of a run's samples and its scene, differentiated along the samples' own derivative."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.sensitivity.keys import RealKey, moved
from ab_sim.scene.model import Scene

OfSamples = Callable[[np.ndarray, Scene], np.ndarray]
"""From samples, shape (samples, channels), and the scene that they are of."""


class Along(NamedTuple):
    """A function's values on the way, two steps back and two ahead."""

    values: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    step: float
    """Of the key."""

    @property
    def derivative(self) -> np.ndarray:
        """By differences of fourth order."""
        a, b, _, d, e = self.values
        found: np.ndarray = (8.0 * (d - b) - (e - a)) / (12.0 * self.step)
        return found

    def is_smooth(self, share: float, rounding: np.ndarray) -> np.ndarray:
        """Whether neither a jump nor a kink is there, of each value.

        Args:
            share: of a derivative that may be missing, and
            rounding: of one that is rounding, same shape.
        """
        a, b, here, d, e = self.values
        near, far = (d - b) / (2.0 * self.step), (e - a) / (4.0 * self.step)
        # What is smooth bends twice as far in two steps as in one; at a kink it bends once.
        bend, wide = (d + b - 2.0 * here) / self.step, (e + a - 2.0 * here) / (2.0 * self.step)
        off = np.maximum(np.abs(near - far), np.abs(wide - 2.0 * bend))
        most = np.maximum(np.maximum(np.abs(near), np.abs(far)), np.abs(bend))
        found: np.ndarray = off <= np.maximum(share * most, rounding)
        return found


def derivative_along(
    function: OfSamples, samples: np.ndarray, way: np.ndarray, scene: Scene, key: RealKey, by: float
) -> Along:
    """Of a function of samples and scene, by a key of it that both depend on.

    Args:
        function: of them.
        samples: shape (samples, channels).
        way: their derivative by the key.
        scene: what they are of.
        key: of it.
        by: how far each channel, and the key, is moved at most, as a share of its largest value.
    """
    size, moves = np.abs(samples).max(axis=0), np.abs(way).max(axis=0)
    share = float((moves[size > 0.0] / size[size > 0.0]).max(initial=0.0))
    if key.value:
        share = max(share, 1.0 / abs(key.value))
    step = by / share if share else by

    def at(count: int) -> np.ndarray:
        there = moved(scene, key.key, key.value + count * step)
        return function(samples + count * step * way, there)

    return Along((at(-2), at(-1), at(0), at(1), at(2)), step)

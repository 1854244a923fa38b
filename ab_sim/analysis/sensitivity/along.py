"""Functions of a run's samples and its scene, differentiated along the samples' own derivative."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.sensitivity.keys import RealKey, moved
from ab_sim.scene.model import Scene

OfSamples = Callable[[np.ndarray, Scene], np.ndarray]
"""From samples, shape (samples, channels), and the scene that they are of."""


class Along(NamedTuple):
    """A derivative, and how sure it is."""

    whole: np.ndarray
    """By differences of fourth order."""
    near: np.ndarray
    far: np.ndarray
    """By central differences of one step and of two: alike where the function is smooth."""
    here: np.ndarray
    """The function's value."""


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

    near, far = ((at(count) - at(-count)) / (2.0 * count * step) for count in (1, 2))
    return Along((4.0 * near - far) / 3.0, near, far, at(0))

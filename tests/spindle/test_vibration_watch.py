"""The measured vibration of a window is the root mean square about its mean, however short."""

import numpy as np
import pytest

from ab_sim.model.spindle.segments_execution import LEAST_SAMPLES, VibrationCondition
from ab_sim.scene.segments import Until


@pytest.mark.parametrize("count", [LEAST_SAMPLES, LEAST_SAMPLES + 1, 50])
def test_root_mean_square_about_the_mean(count: int) -> None:
    until = Until(vibration_rms_below=1.0, over=1e-3 * count, at_most=10.0)
    watch = VibrationCondition(until, 0.0)
    vectors = np.random.default_rng(count).normal((0.0, 3.0, 9.81), 2.0, (count + 1, 3))
    for k, vector in enumerate(vectors):
        assert watch.rms is None
        watch.receive(1e-3 * k, "pickup", 7_000_000 + 1_000_000 * k, vector.tolist())
    window = vectors[:count]
    expected = np.sqrt(np.mean(np.sum((window - window.mean(axis=0)) ** 2, axis=1)))
    assert watch.rms == pytest.approx(expected, rel=1e-12)
    assert not watch.met

"""What an accelerometer's samples are worth: their noise, and what they show that is not there."""

import math

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive.pickup import Pickup, noise_variance
from ab_sim.scene import load_scene
from ab_sim.scene.sensors import ALIASING, Accelerometer, arm_frame, ball_frame, race_frame

STEP = 1e-4


def sensor(**given: float) -> Accelerometer:
    return Accelerometer(**{"range": 1e9, "noise_density": 0.0, "resolution": 0.0, **given})


@pytest.mark.parametrize("bandwidth", [10.0, 200.0, 0.5 / STEP])
def test_variance_is_that_of_its_readings_at_rest(bandwidth: float) -> None:
    noisy = sensor(noise_density=0.02, bandwidth=bandwidth, sample_rate=1 / STEP)
    shown = Pickup(noisy, STEP).process(1, np.zeros((400_000, 2)))
    # Neighbouring readings tell less than independent ones: of those there are 2 F_c a second.
    independent = shown.size * 2.0 * bandwidth * STEP
    expected = noise_variance(noisy, STEP)
    assert np.mean(shown**2) == pytest.approx(expected, rel=5 * math.sqrt(2 / independent))


def test_variance_in_band_is_the_low_passs_noise_bandwidth_times_the_density() -> None:
    """Of the analogue low-pass, pi / (2 sqrt 2) F_c, where steps are short for it."""
    analogue = 0.02**2 * 50.0 * math.pi / (2.0 * math.sqrt(2.0))
    found = noise_variance(sensor(noise_density=0.02, bandwidth=50.0), 1e-6)
    assert found == pytest.approx(analogue, rel=1e-6)


def test_variance_of_rounding_alone_is_a_twelfth_of_its_square() -> None:
    assert noise_variance(sensor(resolution=0.6), STEP) == pytest.approx(0.03)
    assert noise_variance(sensor(), STEP) == 0.0


def test_what_vibrates_too_fast_for_the_samples_shows_as_something_slower() -> None:
    """900 Hz, sampled at 1000 Hz, is 100 Hz, as large as the low-pass and the warning say."""
    given = sensor(bandwidth=600.0, sample_rate=1000.0)
    t = np.arange(1, 20_001) * STEP
    force = np.column_stack([np.cos(2 * np.pi * 900.0 * t), np.zeros(len(t))])
    samples = Pickup(given, STEP).process(1, force)[9::10, 0][1000:]
    heard = np.abs(np.fft.rfft(samples)) * 2 / len(samples)
    assert np.fft.rfftfreq(len(samples), 1e-3)[heard.argmax()] == pytest.approx(100.0)
    straight_lines = 1 - (math.pi * 900.0 * STEP) ** 2 / 3
    assert heard.max() == pytest.approx(given.gain(900.0) * straight_lines, rel=2e-3)
    assert heard.max() < given.gain(500.0) == pytest.approx(0.8214, abs=1e-4)
    assert "up to 82 % of the amplitude of vibration above 500 Hz" in given.aliasing(STEP)


def test_the_bandwidth_that_would_do_does() -> None:
    assert sensor(bandwidth=158.5, sample_rate=1000.0).aliasing(STEP) == ""
    too_wide = sensor(bandwidth=158.6, sample_rate=1000.0)
    assert too_wide.gain(500.0) > ALIASING
    assert "lower its bandwidth below 158.5 Hz" in too_wide.aliasing(STEP)


def test_a_sample_at_each_step_leaves_nothing_out() -> None:
    assert sensor(bandwidth=5000.0, sample_rate=1 / STEP).aliasing(STEP) == ""


@pytest.mark.parametrize(
    "name", ["deck", "drive_housing", "spindle", race_frame(3), ball_frame(12), arm_frame(0)]
)
def test_a_sensor_cannot_have_the_name_of_another_frame(name: str) -> None:
    with pytest.raises(SceneError, match=f"name {name} is"):
        load_scene("thesis-hold", [f"sensors.{name}={{}}"])


def test_a_name_like_it_is_free() -> None:
    assert "ball" in load_scene("thesis-hold", ["sensors.ball={}"]).sensors

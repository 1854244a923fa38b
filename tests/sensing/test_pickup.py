"""The accelerometer's signal chain: each link against its formula, and steps in any grouping."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy import signal, stats

from ab_sim.drive.pickup import NOISE_BLOCK, Pickup
from ab_sim.scene.sections import Solver
from ab_sim.scene.sensors import Accelerometer, steps_per_sample

STEP = 1e-4
CLEAN = Accelerometer(
    range=1e9, noise_density=0.0, resolution=0.0, bandwidth=100.0, sample_rate=1 / STEP
)
"""Nothing but the low-pass."""


def pickup(step: float = STEP, **changes: Any) -> Pickup:
    return Pickup(CLEAN.model_copy(update=changes), step)


def along_x(values: Any) -> np.ndarray:
    """Specific force along the sensor's first axis."""
    return np.column_stack((values, np.zeros(len(values))))


def gain(sensor: Pickup, frequency: float) -> complex:
    """Measured: a sine that has run in, over a hundred whole periods."""
    per_period = round(1 / (frequency * sensor.step))
    phase = 2 * np.pi * np.arange(1, 200 * per_period + 1) / per_period
    shown = sensor.process(1, along_x(np.cos(phase)))[-100 * per_period :, 0]
    return 2 * np.mean(shown * np.exp(-1j * phase[-100 * per_period :]))


def butterworth(frequency: float, bandwidth: float) -> complex:
    s = 1j * frequency / bandwidth
    return 1 / (s * s + math.sqrt(2) * s + 1)


def test_at_rest_a_constant_passes_unchanged() -> None:
    sensor = pickup(bandwidth=37.0)
    constant = np.array([3.0, -9.80665])
    sensor.reset(constant)
    np.testing.assert_array_equal(sensor.reading, constant)
    shown = sensor.process(1, np.tile(constant, (500, 1)))
    np.testing.assert_array_equal(shown, np.tile(constant, (500, 1)))


@pytest.mark.parametrize("bandwidth", [20.0, 100.0, 0.5 / STEP])
def test_gain_at_zero_frequency_is_one(bandwidth: float) -> None:
    shown = pickup(bandwidth=bandwidth).process(1, along_x(np.ones(5000)))
    np.testing.assert_allclose(shown[-1], [1.0, 0.0], rtol=1e-12)


def test_gain_at_the_bandwidth_is_3_db_down() -> None:
    decibels = 20 * math.log10(abs(gain(pickup(bandwidth=100.0), 100.0)))
    assert decibels == pytest.approx(-10 * math.log10(2), abs=0.005)


@pytest.mark.parametrize("frequency", [5.0, 50.0, 100.0, 200.0])
def test_response_is_the_butterworth_filters(frequency: float) -> None:
    """Amplitude and phase; the straight lines between steps take the stated share off."""
    expected = butterworth(frequency, 100.0) * (1 - (math.pi * frequency * STEP) ** 2 / 3)
    assert gain(pickup(), frequency) == pytest.approx(expected, abs=1e-4 * abs(expected))


@pytest.mark.parametrize("ratio", [0.5, 0.3, 0.1, 1e-3])
def test_filter_is_scipys_first_order_hold(ratio: float) -> None:
    """At any bandwidth that a scene may have, whatever the input."""
    w = 2 * math.pi * ratio / STEP
    low_pass = ([w * w], [1.0, math.sqrt(2) * w, w * w])
    b, a, _ = signal.cont2discrete(low_pass, STEP, method="foh")
    force = np.random.default_rng(1).standard_normal(2000)
    force[0] = 0.0
    shown = pickup(bandwidth=ratio / STEP).process(0, along_x(force))
    np.testing.assert_allclose(shown[:, 0], signal.lfilter(b.ravel(), a, force), atol=1e-9)


def test_step_response_is_the_analytic_one() -> None:
    """The step of the force is a ramp over one integration step, so it counts from its middle."""
    w = 2 * math.pi * 100.0 / math.sqrt(2)
    shown = pickup(step=1e-5, sample_rate=1e5).process(1, along_x(np.ones(4000)))[:, 0]
    t = (np.arange(1, 4001) - 0.5) * 1e-5
    analytic = 1 - np.exp(-w * t) * (np.cos(w * t) + np.sin(w * t))
    np.testing.assert_allclose(shown, analytic, atol=2e-6)
    assert shown.max() == pytest.approx(1 + math.exp(-math.pi), rel=1e-4), "overshoot"


def test_ramp_is_followed_late_by_the_filters_delay() -> None:
    """Exactly: straight lines are what the hold knows."""
    sensor = pickup(bandwidth=300.0)
    ramp = np.arange(1, 3001) * STEP
    delay = math.sqrt(2) / (2 * math.pi * 300.0)
    np.testing.assert_allclose(
        sensor.process(1, along_x(ramp))[-100:, 0], ramp[-100:] - delay, rtol=1e-12
    )


def test_limit_is_the_input_itself_but_for_the_delay() -> None:
    """Highest bandwidth, no noise, no digits, wide range."""
    highest = 0.5 / STEP
    delay = math.sqrt(2) / (2 * math.pi * highest)
    assert delay < 0.5 * STEP
    t = np.arange(1, 5001) * STEP
    force = np.column_stack((16 * np.cos(60 * t), 16 * np.sin(60 * t)))
    late = np.column_stack((16 * np.cos(60 * (t - delay)), 16 * np.sin(60 * (t - delay))))
    shown = pickup(bandwidth=highest).process(1, force)
    np.testing.assert_allclose(shown[50:], late[50:], atol=16 * 1e-5)


@pytest.mark.parametrize("bandwidth", [50.0, 400.0])
def test_noise_has_its_density_in_band_and_the_low_passs_shape(bandwidth: float) -> None:
    density = 0.02
    sensor = pickup(bandwidth=bandwidth, noise_density=density, seed=7)
    count, length = 1_000_000, 4096
    still = np.zeros((count, 2))
    sensor.process(1, still[:length])
    shown = sensor.process(1 + length, still)
    frequency, spectrum = signal.welch(
        shown, 1 / STEP, window="hann", nperseg=length, detrend=False, axis=0
    )
    # Bins near 0 and beyond what the straight lines between steps leave undisturbed are left out.
    chosen = (frequency > 10) & (frequency < 1.5 * bandwidth)
    frequency, spectrum = frequency[chosen], spectrum[chosen]
    shape = 1 / (1 + (frequency / bandwidth) ** 4)
    expected = density**2 * shape * (1 - (math.pi * frequency * STEP) ** 2 / 3) ** 2
    ratio = spectrum / expected[:, None]
    # Hann windows that overlap by half are worth 0.947 of as many independent ones.
    averages = 2 * count / length * 0.947
    per_bin = 1 / math.sqrt(averages)
    assert np.abs(ratio - 1).max() < 5 * per_bin
    # Neighbouring bins of a Hann window share half of what they know.
    assert np.abs(ratio.mean(axis=0) - 1).max() < 4 * per_bin * math.sqrt(2 / len(ratio))


def test_noise_is_normal_and_white_and_differs_between_axes_and_seeds() -> None:
    """Looked at before the low-pass."""
    count, size = 100_000, math.sqrt(0.5 / STEP)
    drawn = [pickup(noise_density=1.0, seed=seed).noise(0, count) / size for seed in (0, 1)]
    streams = np.column_stack(drawn)
    assert np.abs(np.corrcoef(streams.T) - np.eye(4)).max() < 5 / math.sqrt(count)
    for values in streams.T:
        assert stats.kstest(values, "norm").pvalue > 1e-3
        neighbours = np.corrcoef(values[1:], values[:-1])[0, 1]
        across = np.corrcoef(values[NOISE_BLOCK:], values[:-NOISE_BLOCK])[0, 1]
        assert max(abs(neighbours), abs(across)) < 5 / math.sqrt(count)


def test_same_seed_same_readings_other_seed_others() -> None:
    one, again, other = (
        pickup(noise_density=1.0, seed=seed).process(1, np.zeros((3000, 2))) for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(one, again)
    assert not np.any(one == other)


def test_noise_adds_to_the_force() -> None:
    force = np.random.default_rng(0).standard_normal((3000, 2))
    noisy = pickup(noise_density=0.1, seed=3)
    alone = pickup(noise_density=0.1, seed=3).process(1, np.zeros_like(force))
    np.testing.assert_allclose(
        noisy.process(1, force), pickup().process(1, force) + alone, atol=1e-12
    )


def test_clipped_at_the_range() -> None:
    t = np.arange(1, 5001) * STEP
    force = np.column_stack((50 * np.cos(60 * t), 5 * np.sin(60 * t)))
    free = pickup().process(1, force)
    shown = pickup(range=20.0).process(1, force)
    np.testing.assert_array_equal(shown, np.clip(free, -20.0, 20.0))
    assert shown.max() == 20.0 and shown.min() == -20.0


def test_low_pass_comes_before_the_range() -> None:
    """A short peak beyond the range that the low-pass takes off is not clipped."""
    force = np.zeros((500, 2))
    force[100] = 100.0
    free = pickup(bandwidth=20.0).process(1, force)
    assert free.max() < 10.0
    np.testing.assert_array_equal(pickup(bandwidth=20.0, range=10.0).process(1, force), free)


@given(st.floats(1e-6, 1.0), st.integers(0, 100))
def test_quantised_to_the_nearest_step(resolution: float, seed: int) -> None:
    force = np.random.default_rng(seed).uniform(-9, 9, (200, 2))
    free = pickup().process(1, force)
    shown = pickup(resolution=resolution).process(1, force)
    assert np.abs(shown - free).max() <= 0.5 * resolution * (1 + 1e-6)
    steps = shown / resolution
    np.testing.assert_allclose(steps, np.rint(steps), rtol=1e-9, atol=1e-6)


def test_range_comes_before_the_quantisation() -> None:
    """Half a resolution beyond the range at most, and on the grid."""
    shown = pickup(resolution=3.0, range=10.0).process(1, np.full((3000, 2), 50.0))
    np.testing.assert_array_equal(shown[-1], [9.0, 9.0])


def test_samples_at_multiples_and_holds_between() -> None:
    force = np.random.default_rng(0).standard_normal((100, 2))
    sensor, free = pickup(sample_rate=1000.0), pickup()
    start = np.array([0.5, -0.5])
    sensor.reset(start)
    free.reset(start)
    shown, every_step = sensor.process(3, force), free.process(3, force)
    for row, step in enumerate(range(3, 103)):
        sampled = step // 10 * 10 - 3
        expected = every_step[sampled] if sampled >= 0 else start
        np.testing.assert_array_equal(shown[row], expected)
    np.testing.assert_array_equal(sensor.reading, shown[-1])


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi), st.integers(0, 100))
def test_turning_force_and_sensor_together_changes_nothing(
    angle: float, turn: float, seed: int
) -> None:
    force = np.random.default_rng(seed).standard_normal((300, 2))
    c, s = math.cos(turn), math.sin(turn)
    turned = force @ np.array([[c, s], [-s, c]])
    settings = {"noise_density": 0.01, "range": 2.0, "sample_rate": 2000.0, "seed": seed}
    here = pickup(axis_angle=angle, **settings).process(1, force)
    there = pickup(axis_angle=angle + turn, **settings).process(1, turned)
    np.testing.assert_allclose(here, there, atol=1e-12)


def test_axes_are_at_their_angles() -> None:
    sensor = pickup(axis_angle=math.radians(30))
    sensor.reset(np.array([math.cos(math.radians(30)), math.sin(math.radians(30))]))
    np.testing.assert_allclose(sensor.reading, [1.0, 0.0], atol=1e-15)
    sensor.reset(np.array([0.0, 2.0]))
    np.testing.assert_allclose(sensor.reading, [1.0, math.sqrt(3)], rtol=1e-15)


REAL = {
    "axis_angle": 0.3,
    "range": 3.0,
    "noise_density": 0.01,
    "resolution": 1e-3,
    "seed": 11,
}


@given(
    st.lists(st.integers(0, 700), min_size=1, max_size=8),
    st.integers(0, 3000),
    st.sampled_from([10000.0, 2000.0, 10000 / 7, 10.0]),
    st.booleans(),
)
def test_bit_identical_however_the_steps_are_grouped(
    groups: list[int], first: int, rate: float, digital: bool
) -> None:
    settings = {**REAL, "sample_rate": rate, "resolution": 1e-3 if digital else 0.0}
    count = sum(groups)
    force = np.random.default_rng(count).standard_normal((count, 2))
    whole, parts = pickup(**settings), pickup(**settings)
    expected = whole.process(first, force)
    done = 0
    for size in groups:
        shown = parts.process(first + done, force[done : done + size])
        assert shown.shape == (size, 2)
        np.testing.assert_array_equal(shown, expected[done : done + size])
        done += size
    for one, other in zip(whole.state, parts.state, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("layout", ["C", "F", "strided"])
def test_bit_identical_step_by_step_whatever_the_memory_layout(layout: str) -> None:
    force = np.random.default_rng(2).standard_normal((2500, 2))
    expected = pickup(**REAL).process(1, force)
    if layout == "strided":
        wide = np.zeros((2500, 11))
        wide[:, 9:] = force
        given_as = wide[:, 9:]
    else:
        given_as = np.array(force, order=layout)
    np.testing.assert_array_equal(pickup(**REAL).process(1, given_as), expected)
    single = pickup(**REAL)
    rows = [single.process(1 + k, given_as[k : k + 1]) for k in range(2500)]
    np.testing.assert_array_equal(np.concatenate(rows), expected)


def test_going_back_to_a_state_repeats_the_readings() -> None:
    force = np.random.default_rng(2).standard_normal((3000, 2))
    sensor = pickup(**REAL, sample_rate=1000.0)
    sensor.process(1, force[:1234])
    kept = sensor.state
    expected = sensor.process(1235, force[1234:])
    sensor.state = kept
    np.testing.assert_array_equal(sensor.process(1235, force[1234:]), expected)
    other = pickup(**REAL, sample_rate=1000.0)
    other.state = kept
    np.testing.assert_array_equal(other.process(1235, force[1234:]), expected)


def test_reset_starts_anew() -> None:
    force = np.random.default_rng(2).standard_normal((500, 2))
    sensor = pickup(**REAL)
    expected = sensor.process(1, force)
    sensor.reset(np.zeros(2))
    np.testing.assert_array_equal(sensor.process(1, force), expected)


def test_what_is_given_is_not_changed() -> None:
    force = np.ones((20, 2))
    pickup(**REAL).process(1, force)
    np.testing.assert_array_equal(force, np.ones((20, 2)))


def test_parameters_are_documented_and_have_defaults() -> None:
    assert Accelerometer.__doc__ and Accelerometer.equation and Accelerometer.source
    parameters = Accelerometer.model_json_schema()["properties"]
    assert set(parameters) == set(Accelerometer().model_dump())
    for key, field in parameters.items():
        assert field["description"] and field["unit"], key


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("range", 0.0),
        ("noise_density", -1.0),
        ("bandwidth", 0.0),
        ("sample_rate", math.inf),
        ("resolution", -1e-3),
        ("seed", -1),
        ("seed", 1.5),
        ("axis_angle", math.nan),
        ("bandwidth", True),
    ],
)
def test_refuses_parameters_out_of_bounds(key: str, value: Any) -> None:
    with pytest.raises(ValidationError):
        Accelerometer.model_validate({key: value})


def test_defaults_suit_the_default_step() -> None:
    Accelerometer().check("sensors.a", Solver().step)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sample_rate": 300.0}, r"sample_rate = 300 Hz.* 333\.3333333 and 250 Hz"),
        ({"sample_rate": 700.0}, r"sample_rate = 700 Hz.* 1000 and 500 Hz"),
        ({"sample_rate": 1001.0}, r"sample_rate = 1001 Hz.* 1000 Hz"),
        ({"bandwidth": 501.0}, r"bandwidth = 501 Hz: .* 500 Hz at solver\.step"),
        ({"resolution": 200.0}, r"resolution = 200 m/s\^2: .* the range"),
    ],
)
def test_refuses_what_does_not_go_with_the_step(changes: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=r"^sensors\.a\." + message):
        Accelerometer(**changes).check("sensors.a", 1e-3)


@given(st.integers(1, 10**9), st.integers(1, 10**6))
def test_rates_that_work_are_found_and_advised_ones_work(nanoseconds: int, steps: int) -> None:
    step = nanoseconds * 1e-9
    rate = 1 / (step * steps)
    assert steps_per_sample(rate, step) == steps
    assert steps_per_sample(float(f"{rate:.10g}"), step) == steps


def test_no_pickup_without_whole_steps_between_samples() -> None:
    with pytest.raises(ValueError, match="sample_rate"):
        pickup(sample_rate=3e3)

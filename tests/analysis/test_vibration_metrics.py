"""Vibration velocity from 10 to 1000 Hz: beside closed forms, and spectra of one's own."""

import math
from typing import Any

import numpy as np
import pytest
from scipy import signal

from ab_sim.analysis import metrics_of, metrics_of_blocks, run_scene
from ab_sim.analysis.metrics.vibration import BandPass
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import load_scene
from tests.analysis.made import made

KEYS = ["vibration_velocity_rms", "vibration_velocity_peak"]


def gain(frequency: Any, rate: float) -> Any:
    """Of the filters: Butterworth's, with frequencies as the bilinear transform bends them."""
    bent = np.tan(np.pi * np.asarray(frequency) / rate)
    with np.errstate(divide="ignore"):
        passed = 1 / (1 + (math.tan(math.pi * 10 / rate) / bent) ** 8)
        if rate > 2000:
            passed = passed / (1 + (bent / math.tan(math.pi * 1000 / rate)) ** 8)
    return np.sqrt(passed)


def swinging(frequency: float, step: float, count: int, **more: Any) -> Trajectory:
    """With 2 mm/s along x, 1 mm/s along y."""
    angle = lambda t: 2 * math.pi * frequency * t  # noqa: E731
    channels = {
        "vx": lambda t: 2e-3 * np.sin(angle(t)),
        "vy": lambda t: 1e-3 * np.cos(angle(t)),
        **more,
    }
    return made(balls=0, step=step, count=count, **channels)


@pytest.mark.parametrize(
    ("frequency", "step"),
    [(5.0, 1e-3), (10.0, 1e-3), (20.0, 1e-3), (100.0, 1e-3), (100.0, 1e-4), (1000.0, 1e-4),
     (2000.0, 1e-4), (80.0, 5e-3)],
)  # fmt: skip
def test_a_sine_comes_through_by_the_filters_gain(
    scene: Any, frequency: float, step: float
) -> None:
    """In 20 s, of which the last two have whole periods; reports have it in mm/s."""
    run = swinging(frequency, step, round(20 / step) + 1)
    metrics = metrics_of(run, alone(scene), KEYS)
    passed = gain(frequency, 1 / step)
    rms = 2e-3 / math.sqrt(2) * passed
    assert metrics.vibration_velocity_rms == pytest.approx(rms, rel=2e-3)
    assert metrics["vibration_velocity_rms"] == 1e3 * metrics.vibration_velocity_rms
    if 20 <= frequency <= 1000:  # else what begins at once passes better than what goes on
        assert metrics.vibration_velocity_peak == pytest.approx(2e-3 * passed, rel=0.15)


@pytest.mark.parametrize("step", [1e-3, 2e-4, 4e-5])
def test_the_filters_are_those_of_scipy(step: float) -> None:
    values = np.cumsum(np.random.default_rng(1).standard_normal((3000, 2)), axis=0)
    steps = np.arange(3001.0)
    passed = BandPass().passed(steps, step * steps, np.vstack([values[:1], values]))[1:]
    sections = signal.butter(4, 10.0, "highpass", fs=1 / step, output="sos")
    if step < 5e-4:
        low = signal.butter(4, 1000.0, "lowpass", fs=1 / step, output="sos")
        sections = np.vstack([sections, low])
    at_rest = signal.sosfilt_zi(sections)[:, :, None] * values[0]
    expected, _ = signal.sosfilt(sections, values, axis=0, zi=at_rest)
    assert np.abs(passed - expected).max() < 1e-9 * np.abs(expected).max()


def test_3_db_are_lost_at_10_and_at_1000_hz(scene: Any) -> None:
    """As of what instruments by the standard do: the band's ends."""
    for frequency in (10.0, 1000.0):
        run = swinging(frequency, 1e-4, 100_001)
        found = metrics_of(run, alone(scene), KEYS).vibration_velocity_rms
        assert found == pytest.approx(2e-3 / 2, rel=5e-3)


def test_a_steady_velocity_is_no_vibration(scene: Any) -> None:
    run = made(balls=0, vx=lambda t: 0 * t + 0.1)
    assert metrics_of(run, alone(scene), KEYS).vibration_velocity_peak == pytest.approx(
        0, abs=1e-12
    )


@pytest.mark.parametrize("size", [1, 2, 7, 1000, 3001])
def test_it_is_found_piece_by_piece(scene: Any, size: int) -> None:
    run = swinging(30.0, 1e-3, 3001)

    def pieces() -> Any:
        for first in range(0, len(run), size):
            yield Trajectory(run.channels, run.samples[first : first + size])

    one, other = (
        metrics_of_blocks(pieces, len(run), alone(scene), KEYS),
        metrics_of(run, alone(scene)),
    )
    for key in KEYS:
        assert one[key] == pytest.approx(other[key], rel=1e-12)


def test_every_second_sample_tells_the_same(scene: Any) -> None:
    """Whole or decimated, and where the decimation begins within the run."""
    run = swinging(30.0, 1e-3, 10_001)
    whole = metrics_of(run, alone(scene), KEYS)
    for rows in (np.arange(0, 10_001, 2), np.r_[0:4000, 4000:10_001:2]):
        decimated = Trajectory(run.channels, run.samples[rows])
        metrics = metrics_of(decimated, alone(scene), KEYS)
        assert metrics.vibration_velocity_rms == pytest.approx(
            whole.vibration_velocity_rms, rel=2e-3
        )


def test_samples_too_far_apart_tell_nothing(scene: Any) -> None:
    """10 ms and a quarter of a turn are the widest; for the peak anywhere in the run."""
    for step, speed, known in ((0.01, 100.0, True), (0.0101, 100.0, False), (0.01, 160.0, False)):
        run = swinging(20.0, step, 1001, angle=lambda t, s=speed: s * t)
        metrics = metrics_of(run, alone(scene), KEYS)
        assert [metrics[key] is not None for key in KEYS] == [known, known]
    run = swinging(20.0, 1e-3, 10_001)
    gap = Trajectory(run.channels, np.delete(run.samples, slice(2000, 2100), axis=0))
    metrics = metrics_of(gap, alone(scene), KEYS)
    assert metrics["vibration_velocity_rms"] == pytest.approx(
        2 / math.sqrt(2) * gain(20.0, 1000), rel=5e-3
    )
    assert metrics["vibration_velocity_peak"] is None
    assert metrics_of(run.last(1), alone(scene), KEYS)["vibration_velocity_rms"] == 0.0


def test_samples_at_uneven_steps_tell_nothing(scene: Any) -> None:
    """The filters would begin anew all the time, and let nothing through."""
    run = swinging(30.0, 1e-3, 10_001)
    rows = np.flatnonzero(np.random.default_rng(1).random(10_001) < 0.5)
    uneven = Trajectory(run.channels, run.samples[rows])
    assert [metrics_of(uneven, alone(scene), KEYS)[key] for key in KEYS] == [None, None]
    late = Trajectory(run.channels, run.samples[np.r_[0:9500, rows[rows >= 9500]]])
    metrics = metrics_of(late, alone(scene), KEYS)
    assert metrics["vibration_velocity_rms"] is None


@pytest.mark.parametrize("speed", [70.0, 200.0])
def test_a_disc_alone_whirls_by_the_closed_form(scene: Any, speed: float) -> None:
    """V = w M e w^2 / abs(k - M w^2 + i c w), along x and y alike."""
    M, e, k, c = 0.1, 1e-4, 1000.0, 0.2
    held = alone(
        scene, profile=None, start={"speed": speed}, effects={"suspension": {"damping": c}},
        duration=20.0,
    )  # fmt: skip
    velocity = speed * M * e * speed**2 / abs(k - M * speed**2 + 1j * c * speed)
    found = run_scene(held).metrics.vibration_velocity_rms
    expected = velocity / math.sqrt(2) * gain(speed / (2 * math.pi), 1000)
    assert found == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(
    ("turns", "where"), [(8.0, "below"), (12.0, None), (900.0, None), (1100.0, "above")]
)
def test_a_spindle_beside_the_band_has_no_broad_band_velocity(
    scene: Any, turns: float, where: str | None
) -> None:
    """The band leaves out its once-per-turn part; the whole velocity has it."""
    run = swinging(turns, 1e-4, 20_001, speed=lambda t: 0 * t - 2 * math.pi * turns)
    keys = [*KEYS, "vibration_velocity_null", "velocity_rms"]
    metrics = metrics_of(run, alone(scene), keys)
    assert metrics["velocity_rms"] == pytest.approx(2 / math.sqrt(2), rel=0.2)
    why = metrics["vibration_velocity_null"]
    if where is None:
        assert metrics["vibration_velocity_rms"] is not None and why is None
    else:
        assert metrics["vibration_velocity_rms"] is metrics["vibration_velocity_peak"] is None
        assert why == f"the spindle's {turns:g} turns a second are {where} the band"


def alone(scene: Any, **changes: Any) -> Any:
    """The thesis' rotor without balls."""
    effects = {"ball_spin": None, "viscous_drag": None, **changes.pop("effects", {})}
    none = {"count": 0, "mass": None, "radius": None}
    return scene(balls=none, effects=effects, **changes)


def spectrum_rms(velocity: np.ndarray, rate: float) -> float:
    """Of a stretch, by its windowed spectrum and the filters' gain, axis by axis; the largest."""
    window = np.hanning(len(velocity))[:, None]
    spectra = np.abs(np.fft.rfft(velocity * window, axis=0)) ** 2
    spectra[1:] *= 2
    passed = gain(np.fft.rfftfreq(len(velocity), 1 / rate), rate)[:, None] ** 2
    squares = np.sum(spectra * passed, axis=0) / len(velocity) / np.sum(window**2)
    return math.sqrt(squares.max())


SENSOR = "sensors={{tip: {{position: [0.05, -0.02, 0.01], axis_angle: {angle}}}}}"


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_at_a_sensor_of_a_deck_in_space(angle: float) -> None:
    """From where the sensor is at each sample, differentiated, on axes of the deck."""
    scene = load_scene(
        "couple-unbalance",
        ["profile=", "start.speed=300", "duration=4", SENSOR.format(angle=angle), "balls.race=0",
         "solver.step=5e-4"],
    )  # fmt: skip
    run = run_scene(scene)
    path, arm = run.trajectory, np.array([0.05, -0.02, 0.01])
    place = path.position + path.turned @ arm
    velocity = np.gradient(place, path["time"], axis=0)
    x, y, z = np.einsum("nij,ni->jn", path.turned, velocity)
    on_axes = np.column_stack(
        (x * math.cos(angle) + y * math.sin(angle), y * math.cos(angle) - x * math.sin(angle), z)
    )[-len(path) // 10 :]
    found = run.metrics.vibration_velocity_rms
    assert found == pytest.approx(spectrum_rms(on_axes, 2000.0), rel=0.02)
    at_centre = run_scene(load_scene("couple-unbalance", [
        "profile=", "start.speed=300", "duration=4", "balls.race=0", "solver.step=5e-4",
    ])).metrics.vibration_velocity_rms  # fmt: skip
    assert at_centre < 0.5 * found, "the deck tilts, which lifts the sensor and not C"


def test_the_largest_of_several_sensors_counts(scene: Any) -> None:
    """In the plane all are alike, but for how their axes lie."""
    run = swinging(100.0, 1e-3, 10_001, vy=lambda t: 2e-3 * np.sin(200 * math.pi * t))
    one = metrics_of(run, alone(scene), KEYS).vibration_velocity_rms
    turned = {"axis_angle": math.pi / 4}
    two = metrics_of(run, alone(scene, sensors={"flat": {}, "turned": turned}), KEYS)
    assert two.vibration_velocity_rms == pytest.approx(math.sqrt(2) * one, rel=1e-9)

"""Derived quantities, on curves whose figures are known, and offline runs."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis import (
    first_passage_of_opposite,
    peak_whirl,
    replay,
    run_scene,
    time_of_speed,
)
from ab_sim.base.errors import InputError
from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording import Recording
from ab_sim.scene import check_scene
from tests.analysis.made import made
from tests.recorded import read_recording


@pytest.mark.parametrize("top", [0.50037, 0.49963])
def test_peak_between_samples(top: float) -> None:
    """W = 3 - (t - top)^2, going round at 50 rad/s: after the largest sample, or before it."""

    def whirl(t: np.ndarray) -> np.ndarray:
        return 3 - (t - top) ** 2

    z = lambda t: whirl(t) * np.exp(50j * t)  # noqa: E731
    dz = lambda t: (-2 * (t - top) + 50j * whirl(t)) * np.exp(50j * t)  # noqa: E731
    run = made(
        x=lambda t: z(t).real, y=lambda t: z(t).imag, vx=lambda t: dz(t).real,
        vy=lambda t: dz(t).imag,
    )  # fmt: skip
    peak, at = peak_whirl(run)
    # A cubic between samples is wrong by (w h)^4 / 384; the largest sample is 1.4e-7 less.
    assert peak == pytest.approx(3.0, abs=6e-8)
    assert at == pytest.approx(top, abs=1e-4)


def test_peak_at_the_end() -> None:
    peak, at = peak_whirl(made(x=lambda t: t, vx=np.ones_like))
    assert (peak, at) == (1.0, 1.0)


def test_first_passage_needs_all_balls_and_is_found_between_samples() -> None:
    run = made(
        balls=2,
        ball_0_angle=lambda t: -8 * t,
        ball_0_rate=lambda t: np.full_like(t, -8.0),
        ball_1_angle=lambda t: -5 * t,
        ball_1_rate=lambda t: np.full_like(t, -5.0),
    )
    assert first_passage_of_opposite(run) == pytest.approx(math.pi / 5, abs=1e-9)


def test_first_passage_may_be_at_the_start_or_not_happen() -> None:
    assert first_passage_of_opposite(made(ball_0_angle=lambda t: np.full_like(t, -4.0))) == 0.0
    assert first_passage_of_opposite(made(ball_0_angle=lambda t: np.full_like(t, -3.0))) is None
    assert first_passage_of_opposite(made(balls=0)) is None


def test_time_of_speed() -> None:
    run = made(speed=lambda t: 40 * t)
    assert time_of_speed(run, 10.0101) == pytest.approx(0.2502525)
    assert time_of_speed(run, 0.0) == 0.0
    assert time_of_speed(run, 41.0) is None


def test_offline_samples_on_and_off_the_grid(scene: Any) -> None:
    times = [2.5, 0.0, 1.23456, 6.0, 2.5]
    result = run_scene(scene(duration=3.0), times)
    assert [sample.time for sample in result.samples] == times
    assert result.samples[0] is result.samples[4]
    assert result.trajectory["time"][-1] == 6.0, "as long as the last time asked for"
    assert len(result.trajectory) == 6001
    drive = Drive(scene())
    drive.advance(2500)
    assert result.samples[0].theta.tobytes() == drive.observe().theta.tobytes()
    json.dumps(result.report(), allow_nan=False)


def test_progress_covers_the_run(scene: Any) -> None:
    seen: list[int] = []
    run_scene(scene(duration=1.0), progress=lambda drive, newest: seen.append(len(newest)))
    assert sum(seen) == 1000
    assert len(seen) == 100


def test_cutting_a_run_does_not_change_it(scene: Any) -> None:
    one, other = (run_scene(scene(duration=1.0), parts=parts).trajectory for parts in (1, 37))
    assert one.samples.tobytes() == other.samples.tobytes()


@pytest.mark.parametrize("times", [[-1.0], [math.nan], [math.inf], [10**400]])
def test_bad_times(scene: Any, times: list[float]) -> None:
    with pytest.raises(InputError, match="finite number, at least 0"):
        run_scene(scene(), times)


def test_absurdly_long_runs_are_refused(scene: Any) -> None:
    with pytest.raises(InputError, match=r"duration = 1e\+06 s: every step"):
        run_scene(scene(duration=1e6))


def test_replay_is_bit_exact(scene: Any) -> None:
    drive = Drive(scene(effects={"rolling_friction": {"arm": 1e-6}}), commanded=True)
    random = np.random.default_rng(1)
    parts = [drive.present()]
    for _ in range(200):
        if random.random() < 0.7:
            drive.command(random.uniform(0, 200))
        parts.append(drive.advance(int(random.integers(1, 9))))
    recorded = Trajectory.join(parts)
    again = replay(drive.scene, recorded)
    assert again.samples.tobytes() == recorded.samples.tobytes()


def test_replay_with_motor_and_accelerometer_is_bit_exact(scene: Any, tmp_path: Path) -> None:
    """Through a recording's file, whose description gives the scene back."""
    made = scene(
        effects={
            "motor": {
                "rotor_inertia": 2.9e-5,
                "torque_limit": 1e-3,
                "proportional_gain": 1e-3,
                "integral_gain": 2e-3,
            },
        },
        sensors={"accelerometer": {"seed": 3}},
    )
    drive = Drive(made, commanded=True)
    random = np.random.default_rng(1)
    with Recording(tmp_path / "run.rrd", description=describe(made)) as recording:
        recording.block(drive.channels, drive.present().samples)
        for _ in range(100):
            if random.random() < 0.3:
                drive.command(random.uniform(0, 200))
            recording.block(drive.channels, drive.advance(int(random.integers(1, 9))).samples)
    back = read_recording(tmp_path / "run.rrd")
    assert back.channels[-3:] == ("motor_torque", "accelerometer_1", "accelerometer_2")
    recorded = Trajectory(back.channels, back.samples)
    assert np.abs(recorded["motor_torque"]).max() == 1e-3, "at its limit"
    assert np.ptp(recorded["accelerometer_1"]) > 0
    assert np.any(recorded["command"] != recorded["speed"])
    again = replay(check_scene(back.description["scene"], "the recording"), recorded)
    assert again.samples.tobytes() == recorded.samples.tobytes()


def test_replay_refuses_gaps(scene: Any) -> None:
    run = Drive(scene(), commanded=True).advance(10)
    with pytest.raises(InputError, match="cannot be replayed"):
        replay(scene(), run)

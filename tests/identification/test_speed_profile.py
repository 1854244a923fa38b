"""The spindle's motion, from what was recorded of it to a profile that runs can follow."""

import numpy as np
import pytest

import ab_sim
from ab_sim.identification.spindle import schedule_from
from ab_sim.model.spindle import SpeedSchedule
from tests.identification import drives

HOLD = {
    "profile.variable_speed_period": {"start_speed": 100.0, "duration": 0.3, "acceleration": 0.0}
}
SCENE = drives.scene(HOLD)
TRUE = SpeedSchedule.of_scene(SCENE)


@pytest.fixture(scope="module")
def run() -> ab_sim.Trajectory:
    return ab_sim.simulate(SCENE).trajectory


def angles(schedule: SpeedSchedule, time: np.ndarray) -> np.ndarray:
    return np.array([schedule.angle(float(t)) for t in time])


@pytest.mark.parametrize("with_angle", [True, False])
def test_of_a_simulation_every_piece_is_found(run: ab_sim.Trajectory, with_angle: bool) -> None:
    angle = run["angle"] if with_angle else None
    found = schedule_from(run["time"], run["speed"], angle, "run")
    assert found.breakpoints[:3] == pytest.approx(TRUE.breakpoints, abs=1e-9)
    assert angles(found, run["time"]) == pytest.approx(run["angle"], abs=1e-9)


def test_an_encoder_alone_is_enough(run: ab_sim.Trajectory) -> None:
    found = schedule_from(run["time"], None, run["angle"], "run")
    assert angles(found, run["time"]) == pytest.approx(run["angle"], abs=1e-6)


def test_a_noisy_tachometer_and_an_encoder(run: ab_sim.Trajectory) -> None:
    """0.3 rad/s and 1 mrad of noise leave less than the encoder's noise."""
    numbers = np.random.default_rng(0)
    speed = run["speed"] + 0.3 * numbers.standard_normal(len(run))
    angle = run["angle"] + 1e-3 * numbers.standard_normal(len(run))
    found = schedule_from(run["time"], speed, angle, "run")
    assert len(found.segments) == len(TRUE.segments) + 1
    assert np.max(np.abs(angles(found, run["time"]) - run["angle"])) < 1e-3


def test_a_curve_is_followed_by_straight_pieces() -> None:
    profile = {"kind": "speed_change", "start_time": 0.3, "duration": 0.4, "to_speed": 60.0}
    curve = ab_sim.simulate(
        drives.scene({"profile": profile, "start.speed": 100.0, "duration": 1.0})
    )
    time, angle = curve.trajectory["time"], curve.trajectory["angle"]
    found = schedule_from(time, curve.trajectory["speed"], angle, "run")
    assert 10 < len(found.segments) <= 401
    assert angles(found, time) == pytest.approx(angle, abs=1e-4)

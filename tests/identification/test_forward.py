"""What a recording would have been: its derivatives, and sensors' low-pass."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ab_sim
from ab_sim.analysis.comparison import without_balls
from ab_sim.identification.colour import whitened, whitening_of
from ab_sim.identification.forward import RecordedDrive
from ab_sim.identification.measured import ACCELERATION, DISPLACEMENT, Measured
from ab_sim.identification.residuals import whiteness_of
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.load import changed_scene
from ab_sim.scene.sensors import Accelerometer
from tests.identification import drives

STICKS = drives.scene({"effects.rolling_friction": {"arm": 3e-6}, "balls.radius": 1e-3})


def measured(drive: ab_sim.Scene, **more: Any) -> Measured:
    """A recording of it without noise, every other step."""
    run = ab_sim.simulate(drive).trajectory
    made = Measured(
        "run", run["time"][2::2], run.position[2::2, :2], (0.0, math.pi / 2), DISPLACEMENT,
        SpeedSchedule.of_scene(drive), True, drive.balls.count > 0, step=drive.solver.step,
    )  # fmt: skip
    return replace(made, **more)


@pytest.mark.parametrize("drive", [drives.scene(), STICKS], ids=["smooth", "friction"])
def test_the_run_under_a_recording_is_the_run_that_was_recorded(drive: ab_sim.Scene) -> None:
    recorded = measured(drive)
    values = {"start.ball_angles": [0.7, -2.0]}
    found = RecordedDrive(drive, recorded).signals(values)
    assert found is not None
    assert found.values == pytest.approx(recorded.signals, abs=1e-15)


def test_a_drive_without_balls_loses_their_mass() -> None:
    bare = without_balls(drives.scene())
    recorded = measured(bare, with_balls=False)
    found = RecordedDrive(drives.scene(), recorded).signals({})
    assert found is not None
    assert found.values == pytest.approx(recorded.signals, abs=1e-15)


@pytest.mark.parametrize(("stepper", "near"), [("rk8", 1e-6), ("imex8", 1e-5)])
def test_differences_across_events_agree_with_sensitivities(stepper: str, near: float) -> None:
    """Compare differences of runs with Richardson's value at another step."""
    drive = changed_scene(STICKS, {"solver": {"stepper": stepper, "step": 0.001}}, "test")
    own = RecordedDrive(drive, measured(drive))
    assert own.side_by_side
    keys = ["effects.rolling_friction.arm", "balls.mass", "start.ball_angles.1"]
    moves, values = [3e-12, 5e-10, 1e-6], {"start.ball_angles.0": 0.7, "start.ball_angles.1": -2.0}
    found = own.signals(values, keys, moves)
    by_rk8 = changed_scene(drive, {"solver.stepper": "rk8"}, "test")
    other = ab_sim.sensitivities(by_rk8, keys, channels=("x", "y")).derivatives[:, :, 2::2]
    assert found is not None
    for expected, difference in zip(other.transpose(1, 2, 0), found.derivatives, strict=True):
        assert np.linalg.norm(expected - difference) < near * np.linalg.norm(difference)


def test_noise_behind_a_low_pass_is_white_again() -> None:
    sensor = Accelerometer(bandwidth=150.0, noise_density=5e-3, resolution=1e-3)
    still = {"profile": None, "rotor.eccentricity": 0.0, "sensors": {"pickup": sensor.model_dump()}}
    drive = drives.scene({**still, "balls": {"count": 0}, "start.ball_angles": None})
    run = ab_sim.simulate(drive).trajectory
    readings = np.column_stack([run["pickup_1"], run["pickup_2"]])[1:]
    recorded = Measured(
        "still", run["time"][1:], readings, (0.0, math.pi / 2), ACCELERATION,
        SpeedSchedule.constant(1.0), True, False, sensor=sensor, step=drive.solver.step,
    )  # fmt: skip
    taps = whitening_of(recorded)
    assert taps is not None
    before = whiteness_of(readings, 1.0, "still")
    after = whiteness_of(whitened(taps, readings), 1.0, "still")
    assert before.z > 100.0 and abs(after.z) < 4.0

"""Bags of test rigs with every sample of their sensors."""

from pathlib import Path

import numpy as np
import pytest

from ab_msgs_py import ImuSample, JointSample, Topic, VibrationSample, WhirlSample
from ab_msgs_py.topics import IMU, JOINT_STATES, PROBE, VIBRATION
from ab_sim.record.bags.contract import encoded, further_sensor
from tests.bags.made import bag_of
from tests.bags.test_reading import imported


def _board(rows: int) -> list[tuple[str, int, bytes]]:
    """Messages of a rig: joints at 1 kHz, an IMU at 500 Hz, probes and a second IMU at 250 Hz."""
    said = []
    for row in range(rows):
        time = 1_000_000 * row
        joint = JointSample(time, 0.5 * row, 500.0, (), (), (), None, "")
        said.append(("/rig/joint_states", time, encoded(JOINT_STATES, joint)))
        fast, slow = 2 * (row // 2), 4 * (row // 4)
        held = VibrationSample(time, (fast, -fast, 9.8), frame="rig/imu_link")
        said.append(("/rig/vibration", time, encoded(VIBRATION, held)))
        if row == fast:
            imu = ImuSample(time, (row, -row, 9.8), 0.0, "rig/imu_link")
            said.append(("/rig/imu/data_raw", time, encoded(IMU, imu)))
        if row == slow:
            far = ImuSample(time, (7.0 * row, 0.0, 0.0), 0.0, "far")
            said.append(("/rig/imu_far/data_raw", time, encoded(IMU, far)))
            place = WhirlSample(time, (1e-6 * row, 2e-6 * row, 0.0), "eddy")
            said.append(("/rig/displacement", time, encoded(PROBE, place)))
    return said


def test_sensors_with_every_sample_are_read(tmp_path: Path) -> None:
    """Rows are at the fastest sensor's stamps; `vibration`, which repeats it, is left out."""
    bag = bag_of(tmp_path / "rig", _board(400), rig_imu_far_data_raw=IMU.type_name)
    made, back = imported(bag)
    assert made.ignored == {} and made.rows == 200
    np.testing.assert_allclose(back["time"], 2e-3 * np.arange(200), rtol=0, atol=1e-12)
    assert back["imu_link_1"].tolist() == (2.0 * np.arange(200)).tolist()
    assert back["angle"].tolist() == (1.0 * np.arange(200)).tolist()
    assert back["far_1"].tolist() == (28.0 * (np.arange(200) // 2)).tolist()
    assert back["eddy_2"].tolist() == (8e-6 * (np.arange(200) // 2)).tolist()
    assert back.channels.count("imu_link_1") == 1
    assert made.notes == [
        f"{name}_1 has 100 samples for 200 rows: each is held until the next one"
        for name in ("far", "eddy")
    ]
    assert back.description["pickups"] == {
        "imu_link": "acceleration", "far": "acceleration", "eddy": "displacement"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("/rig/imu_far/data_raw", IMU),
        ("/rig/displacement_far", PROBE),
        ("/rig/imu_/data_raw", None),
        ("/rig/imu_far/near/data_raw", None),
        ("/other/imu_far/data_raw", None),
        ("/rig/imu_far/temperature", None),
    ],
)
def test_further_sensors_are_known_by_their_topic(name: str, kind: Topic | None) -> None:
    assert further_sensor(name, "/rig") == kind


def test_rows_are_at_the_stamps_of_the_sensor_that_is_named(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "rig", _board(400), rig_imu_far_data_raw=IMU.type_name)
    made, back = imported(bag, rows_of="eddy_1")
    assert made.rows == 100
    assert back["eddy_1"].tolist() == (4e-6 * np.arange(100)).tolist()
    assert back["angle"].tolist() == (2.0 * np.arange(100)).tolist()

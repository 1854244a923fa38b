"""Recordings of a drive with faults by the live recorder.

``drive_sim``, ``profile_controller`` and ``recorder`` run as processes in lock step. Recordings
(.rrd) contain the true motion. Readings of a faulty sensor are only in messages, so they are taken
from ``imu/data_raw`` and ``joint_states`` in the bag, as a firmware receives them.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ab_msgs_py import ImuSample, topics
from ab_sim.record.bags.contract import decoded
from ab_sim.record.bags.reader import Bag
from ab_sim.record.recording import Recording
from ab_sim.scene import Scene
from tests.domains import own_domain
from tests.identification import drives
from tests.nodes.fleet import Fleet
from tests.nodes.lock_step import PERIOD, LockStep
from tests.recorded import read_recording

AT, ENDS = 1.0, 2.5
"""Simulated time at which faults start, and duration of runs [s]."""


class Live(NamedTuple):
    """Files of one run."""

    recording: Path
    """Recording of the true motion (.rrd)."""
    bag: Path
    heard: Path
    """Recording of the sensors' readings (.rrd), a row for each step; NaN without a reading."""


def bench() -> Scene:
    """Return a drive with two balls and a noisy accelerometer that passes the critical speed."""
    return drives.scene(
        {
            "sensors": {"pickup": {"bandwidth": 200.0, "noise_density": 3e-3}},
            "spindle.max_acceleration": 120.0,
            "duration": ENDS,
        }
    )


def recorded_live(folder: Path, scene: Scene, faults: Sequence[str], name: str) -> Live:
    """Run a drive with its controller and recorder, and inject faults during the run.

    Parameters
    ----------
    folder
        Folder for the files.
    scene
        Scene of the drive.
    faults
        Faults as texts, see docs/topics.md; none for a drive without faults.
    name
        Name of the files.
    """
    scene_file = folder / f"{name}.yaml"
    scene_file.write_text(json.dumps(scene.as_mapping()))
    file, bag = folder / f"{name}.rrd", folder / f"{name}-bag"
    with own_domain() as domain:
        fleet = Fleet(domain, folder)
        try:
            live = LockStep(fleet, scene_file, wake_rate=200.0)
            fleet.start("recorder", path=file, bag=bag)
            fleet.until(lambda: fleet.value("recorder", "file"), "the recorder has a drive")
            if faults:
                assert fleet.set("drive_sim", faults=list(faults))[0]
            live.done("profile_controller/start")
            for k in range(round(1000 * ENDS) // PERIOD):
                if faults and k == round(1000 * AT) // PERIOD:
                    live.done("drive_sim/inject_faults")
                live.step(commands=1)
            fleet.until(lambda: fleet.value("recorder", "messages waiting") == "0", "it is written")
            for node in ("profile_controller", "drive_sim", "recorder"):
                assert fleet.stop(node) == 0, fleet.log(node)
        finally:
            fleet.close()
    return Live(file, bag, heard(file, bag, folder / f"{name}-heard.rrd"))


def heard(file: Path, bag: Path, path: Path) -> Path:
    """Write a recording of the readings at each step; the spindle is interpolated.

    Parameters
    ----------
    file
        Recording, for description and times.
    bag
        Bag of the same run.
    path
        File to write.
    """
    told = read_recording(file)
    rows, time = told.samples.copy(), told.samples[:, told.channels.index("time")]
    spun, felt = (
        [told.channels.index(name) for name in names]
        for names in (("speed", "angle"), ("pickup_1", "pickup_2"))
    )
    rows[:, felt] = np.nan
    row, spindle = {round(1e9 * each): k for k, each in enumerate(time.tolist())}, []
    with Bag(bag) as read:
        for kind in (topics.IMU, topics.JOINT_STATES):
            for each in read.messages({f"/{kind.name}"}):
                said = kind.sample(decoded(each.data, kind.type_name))
                if isinstance(said, ImuSample):
                    rows[row[said.time], felt] = said.force[:2]
                else:
                    spindle.append((1e-9 * said.time, said.spindle_speed, said.spindle_angle))
    # An injection has the state told again, at the same time.
    at, speed, angle = np.array(list({said[0]: said for said in spindle}.values())).T
    known = (time >= at[0]) & (time <= at[-1])
    rows[:, spun] = np.nan
    rows[known, spun[0]] = np.interp(time[known], at, speed)
    rows[known, spun[1]] = CubicSpline(at, angle)(time[known])
    # The recorder came after the drive had said where it stands.
    rows = rows[int(np.argmax(known)) :]
    with Recording(path, description=told.description) as written:
        written.block(told.channels, rows)
    return path

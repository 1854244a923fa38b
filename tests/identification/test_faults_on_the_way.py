"""Faults that come to a drive or its sensors while it is recorded: each is told by its sign."""

from pathlib import Path

import numpy as np
import pytest

import ab_sim
from ab_sim.analysis.comparison import without_balls
from ab_sim.base.errors import InputError
from ab_sim.drive.description import describe
from ab_sim.drive.faults.fault import SensedFaults, faults_of
from ab_sim.identification.result import FITS, OFF, Identification
from tests.drive.fault_session import FaultSession
from tests.identification import drives

AT, STEPS = 1000, 2000
DECK = ["effects.suspension.stiffness", "effects.suspension.damping", "rotor.eccentricity"]
GUESS = dict(zip(DECK, (1100.0, 1.7, 8.5e-5), strict=True))


def recorded(path: Path, *faults: str, at: int = AT) -> Path:
    """A run without balls, as its live recorder has it, but that sensors' faults are in it, too."""
    scene = without_balls(
        drives.scene(
            {
                "sensors": {"pickup": {"bandwidth": 200.0, "noise_density": 3e-3}},
                "spindle.max_acceleration": 120.0,
            }
        )
    )
    session = FaultSession(scene)
    session.path.receive(180.0, 0)
    parts = [session.drive.present(), *session.commanded.advance(at)]
    session.inject(*faults)
    parts += list(session.commanded.advance(STEPS - at))
    run = ab_sim.Trajectory.join(parts)
    said = SensedFaults(faults_of(faults), scene)
    said.restart(at)
    samples, steps = run.samples.copy(), run["step"].astype(int)
    after = steps > at
    for name, channels in (("pickup", ("pickup_1", "pickup_2")), ("spindle", ("speed",))):
        columns = [run.channels.index(channel) for channel in channels]
        rows = np.ix_(after, columns)
        samples[rows] = said.altered(name, samples[rows].T, steps[after]).T
        silent = after & np.array([name in said.silent(step) for step in steps.tolist()])
        samples[np.ix_(silent, columns)] = np.nan
    with ab_sim.Recording(path, description=describe(scene)) as recording:
        recording.block(run.channels, samples)
        if faults:
            recording.event(1e-3 * at, f"faults: {', '.join(faults)}", "WARN", "faults")
    return path


def identified(file: Path) -> Identification:
    return ab_sim.identify(file, drives.scene(GUESS), DECK, propose=False)


def test_a_sound_drive_fits(tmp_path: Path) -> None:
    found = identified(recorded(tmp_path / "sound.rrd"))
    assert found.verdict == FITS, found.reasons
    for name, true in zip(DECK, (1000.0, 2.0, 1e-4), strict=True):
        assert abs(found[name].value - true) < 4.0 * found[name].deviation, name


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ("pickup drops 0.3", r"signals.0 \(pickup_1\): .* finite numbers, .* at 1\.0"),
        (
            "pickup drops",
            r"1000 of 2001 samples .* 1.001 s, the longest gap, 1000",
        ),
        ("pickup saturates 0.5", r"is clipped: .* -?0.5 .* at 1\.0"),
        ("spindle drops", "speed: row 1001 .* at 1.001 s"),
        ("spindle saturates 140", "agree until 1.2 s, .* up to 40"),
        ("spindle drifts 20", "agree until 1.2 s"),
    ],
)
def test_a_sensor_that_fails_is_refused_with_its_sign(
    tmp_path: Path, fault: str, says: str
) -> None:
    with pytest.raises(InputError, match=says):
        identified(recorded(tmp_path / "run.rrd", fault))


def test_a_reading_that_hangs_is_refused(tmp_path: Path) -> None:
    table = drives.recorded(drives.scene(), balls=False)
    table["ch2"][1200:] = table["ch2"][1200]
    maps = [drives.mapping(tmp_path)]
    file = drives.write(table, tmp_path / "hung.csv")
    with pytest.raises(InputError, match=r"\(ch2\): repeats .* from 1.2 to 2 s"):
        ab_sim.identify([], drives.scene(GUESS), DECK, without_balls=[file], maps=maps)


def test_a_change_on_the_way_is_told_with_its_time(tmp_path: Path) -> None:
    fault = "suspension softens 0.7"
    found = identified(recorded(tmp_path / "run.rrd", fault))
    (sign,) = (reason for reason in found.reasons if "fits until" in reason)
    until = float(sign.partition("fits until ")[2].split()[0])
    assert found.verdict == OFF and until == pytest.approx(1.0, abs=0.05), sign
    assert found.notes == (f"run: the recorder noted faults: {fault}, from 1 s on",)
    assert "did something change or break then" in sign


def test_a_sensor_that_sits_turned_from_the_beginning_is_asked_about(tmp_path: Path) -> None:
    found = identified(recorded(tmp_path / "run.rrd", "pickup turned 0.5", at=1))
    (sign,) = (reason for reason in found.reasons if "would explain the residuals" in reason)
    assert sign.startswith(
        "disc_angle of run would explain the residuals: with encoder zero = -0.5"
    )
    assert "is the sensor turned" in sign and sign.endswith("to fit it: --free disc_angle")
    assert not any("fits until" in reason for reason in found.reasons)


def test_a_sensor_that_is_late_is_asked_about(tmp_path: Path) -> None:
    table = drives.recorded(drives.scene(), balls=False)
    for name in ("ch1", "ch2"):
        table[name] = np.concatenate([table[name][:3], table[name][:-3]])
    file = drives.write(table, tmp_path / "late.csv")
    found = ab_sim.identify(
        [], drives.scene(GUESS), DECK, without_balls=[file], maps=[drives.mapping(tmp_path)],
        propose=False,
    )  # fmt: skip
    (sign,) = (reason for reason in found.reasons if "would explain the residuals" in reason)
    assert sign.startswith("delay of late would explain the residuals: with delay of late = 0.003")
    assert "is the sensor late?" in sign

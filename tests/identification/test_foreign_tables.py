"""Tables as instruments and other programs write them: encodings, types, units and stamps."""

import datetime
import decimal
import os
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from ab_msgs_py import ImuSample, JointSample, WhirlSample
from ab_msgs_py.topics import IMU, JOINT_STATES, PROBE
from ab_sim.base.errors import InputError
from ab_sim.identification.checks import (
    check_held,
    check_held_signal,
    check_signal,
    check_time,
    spikes_in,
)
from ab_sim.identification.files import measured_of
from ab_sim.identification.mapping import factor_of, read_mapping_file, sensitivity_factor
from ab_sim.identification.spindle import angle_from_pulses
from ab_sim.identification.tables import read_table
from ab_sim.record.bags.contract import encoded
from tests.bags.made import bag_of
from tests.identification import drives

TEXT = "t,speed,ch1,Temp °C\n0.0,1.0,2.5,20\n0.1,1.5,3.5,20\n"


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-16-le", "utf-16-be", "utf-32"]
)
def test_the_encoding_of_a_csv_is_found(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "bench.csv"
    file.write_bytes(TEXT.encode(encoding))
    table = read_table(file)
    assert list(table.columns) == ["t", "speed", "ch1", "Temp °C"]
    assert table.column("ch1", "signals.0").tolist() == [2.5, 3.5]
    assert any("latin-1" in note for note in table.notes) == (encoding == "latin-1")


def parquet(path: Path, values: list[Any], kind: Any = None) -> Path:
    pa.parquet.write_table(pa.table({"c": pa.array(values, kind)}), path)
    return path


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([decimal.Decimal("0.25"), decimal.Decimal("0.75")], None),
        ([datetime.datetime(2024, 5, 1, 0, 0, s) for s in (10, 12)], pa.timestamp("ns")),
        ([datetime.timedelta(seconds=2 * s) for s in (0, 1)], pa.duration("ms")),
        ([datetime.time(second=2 * s) for s in (0, 1)], pa.time64("us")),
        ([0.25, 0.75], pa.float32()),
    ],
)
def test_numbers_of_every_type_are_read(tmp_path: Path, values: list[Any], kind: Any) -> None:
    found = read_table(parquet(tmp_path / "t.parquet", values, kind)).column("c", "time")
    assert found.dtype.kind == "f"
    assert np.diff(found).tolist() == [0.5 if found[0] else 2.0]


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ([True, False], "holds truth values"),
        ([True, None], "holds truth values"),
        (["1.5", "over"], "holds texts, .* 'over' at row 1"),
        ([[1.0], [2.0]], "holds ndarray values"),
        ([None, None], "is empty"),
    ],
)
def test_what_holds_no_numbers_says_what_it_holds(
    tmp_path: Path, values: list[Any], says: str
) -> None:
    table = read_table(parquet(tmp_path / "t.parquet", values))
    with pytest.raises(InputError, match=says):
        table.column("c", "signals.0")


def test_time_stamps_take_no_unit(tmp_path: Path) -> None:
    stamps = [datetime.datetime(2024, 5, 1), datetime.datetime(2024, 5, 2)]
    table = read_table(parquet(tmp_path / "t.parquet", stamps))
    assert table.unit_of("c", None) == "s"
    with pytest.raises(InputError, match="time stamps, .* unit 'ms'"):
        table.unit_of("c", "ms")


@pytest.mark.parametrize("name", ["pipe.csv", "pipe.rrd", "63"])
def test_a_pipe_is_named(tmp_path: Path, name: str) -> None:
    """Also that of a shell's ``<(command)``, which has no ending."""
    pipe = tmp_path / name
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="pipe or a device"):
        read_table(pipe)


def test_a_damaged_unit_is_named(tmp_path: Path) -> None:
    field = pa.field("x", pa.float64(), metadata={"unit": b"\xb0C"})
    file = tmp_path / "damaged.parquet"
    pa.parquet.write_table(pa.table([[1.0, 2.0]], schema=pa.schema([field])), file)
    with pytest.raises(InputError, match="damaged.parquet: .* damaged: 'utf"):
        read_table(file)


def test_an_infinite_sample_is_a_missing_one(tmp_path: Path) -> None:
    table = drives.recorded(drives.scene())
    table["ch1"][400] = np.inf
    file = drives.write(table, tmp_path / "bench.csv")
    found = measured_of(file, drives.scene(), read_mapping_file(drives.mapping(tmp_path)))
    assert np.isfinite(found.rms)
    assert found.notes == ("1 of 2000 samples of ch1 missing or not finite, left out",)


@pytest.mark.parametrize(
    ("digits", "says"),
    [(2, "too few digits"), (None, "keep one sample")],
)
def test_a_repeated_time_is_told_with_its_reason(digits: int | None, says: str) -> None:
    time = np.arange(1000) / 1000.0
    if digits is None:
        time[500] = time[499]
    else:
        time = np.round(time, digits)
    with pytest.raises(InputError, match=says):
        check_time(time, "bench")


@pytest.mark.parametrize(
    ("unit", "si", "factor"),
    [
        *(
            (unit, "rad/s", np.pi / 30.0)
            for unit in ("1/min", "RPM", "min^-1", "U/min", "rpm", "min-1")
        ),
        *((unit, "m/s^2", 9.80665) for unit in ("G", "g", "g_0")),
        ("m/s2", "m/s^2", 1.0),
        ("mm", "m", 1e-3),
    ],
)
def test_units_as_instruments_write_them(unit: str, si: str, factor: float) -> None:
    assert factor_of(unit, si, "bench: speed") == pytest.approx(factor)


def test_a_sensitivity_makes_voltages_signals() -> None:
    assert sensitivity_factor("100 mV/g", "V", "m/s^2", "") == pytest.approx(98.0665)
    assert sensitivity_factor("100 mV/g_0", None, "m/s^2", "") == pytest.approx(0.0980665)
    assert sensitivity_factor("-8 mV/um", "V", "m", "") == pytest.approx(-1.25e-4)
    for wrong in ("100 mV", "0 mV/g", "mV/g"):
        with pytest.raises(InputError, match="like 100 mV/g_0"):
            sensitivity_factor(wrong, "V", "m/s^2", "bench: signals.0")
    with pytest.raises(InputError, match="bench: signals.0.sensitivity"):
        sensitivity_factor("100 mV/g", "V", "m", "bench: signals.0")


def test_a_mapping_takes_a_sensitivity(tmp_path: Path) -> None:
    """1 V for each mm is the same as a column in mm."""
    file = drives.write(drives.recorded(drives.scene()), tmp_path / "bench.csv")
    text = drives.MAP.replace("unit: mm}", "unit: mV, sensitivity: 1 V/m}")
    plain, volts = (
        measured_of(file, drives.scene(), read_mapping_file(drives.mapping(tmp_path, words)))
        for words in (drives.MAP, text)
    )
    assert volts.kind == plain.kind
    assert volts.signals == pytest.approx(plain.signals, rel=1e-12, nan_ok=True)


@pytest.mark.parametrize("size", [5.0, 100.0])
@pytest.mark.parametrize("per_turn", [20.0, 200.0])
def test_a_coarse_resolution_is_not_taken_for_clipping(size: float, per_turn: float) -> None:
    """Readings of a whirl of some steps stay at their peaks as clipped ones do."""
    angle = 2.0 * np.pi * np.arange(5000) / per_turn
    noise = np.random.default_rng(0).standard_normal(5000)
    signal = np.round(size * np.sin(0.999 * angle) + 0.05 * noise)
    remark = check_signal(angle, angle, signal, "signals.0", "bench")
    if per_turn > 20.0:
        assert "resolution is coarse: readings are 1 apart" in remark
        assert "smaller range" in remark
    with pytest.raises(InputError, match="^bench: signals.0: is clipped: "):
        check_signal(angle, angle, np.clip(signal, -0.6 * size, 0.6 * size), "signals.0", "bench")


RAMP = 0.38 * np.arange(4000)
FLUTTER = 0.2 * np.random.default_rng(0).standard_normal(4000)


def once_per_turn(angle: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """What a tachometer with one pulse a turn shows: the speed at the last pulse."""
    last = np.searchsorted(angle, 2.0 * np.pi * np.floor(angle / (2.0 * np.pi)))
    return speed[np.minimum(last, len(speed) - 1)]


@pytest.mark.parametrize(
    "values",
    [
        np.repeat(RAMP, 2),
        np.repeat(RAMP + FLUTTER, 3),
        np.minimum(np.repeat(RAMP, 4), 900.0),
        once_per_turn(0.02 * np.arange(5000.0) ** 2 / 1000, 0.04 * np.arange(5000.0)),
    ],
)
def test_a_held_series_is_named(values: np.ndarray) -> None:
    with pytest.raises(InputError, match="bench: speed: is held: "):
        check_held(values, "speed", "bench")


@pytest.mark.parametrize(
    "values",
    [
        RAMP,
        np.minimum(RAMP, 900.0),
        np.round(RAMP),
        np.round(RAMP / 0.3) * 0.3,
        np.round(RAMP + FLUTTER),
        np.round(900.0 + FLUTTER),
    ],
)
def test_a_ramp_and_a_coarse_tachometer_are_not_held(values: np.ndarray) -> None:
    check_held(values, "speed", "bench")


WHIRL = np.sin(0.05 * np.arange(4000.0)) + 0.01 * FLUTTER


@pytest.mark.parametrize(
    "values",
    [
        np.repeat(WHIRL, 2),
        np.repeat(WHIRL, 4),
        WHIRL[np.arange(9000) * 3 // 10],
    ],
)
def test_a_held_signal_is_named(values: np.ndarray) -> None:
    with pytest.raises(InputError, match="bench: ch1: is held: "):
        check_held_signal(values, "ch1", "bench")


@pytest.mark.parametrize("per_turn", [7.3, 20.0, 200.0])
@pytest.mark.parametrize("size", [1.0, 3.0, 5.0, 20.0, 100.0])
def test_coarse_and_clipped_signals_are_not_held(size: float, per_turn: float) -> None:
    values = size * np.sin(2.0 * np.pi / per_turn * np.arange(8000.0))
    check_held_signal(np.round(values), "ch1", "bench")
    check_held_signal(np.round(values + 0.3 * FLUTTER[0]), "ch1", "bench")
    check_held_signal(np.clip(values, -0.3 * size, 0.3 * size), "ch1", "bench")
    check_held_signal(np.concatenate([np.zeros(3000), values]), "ch1", "bench")


def test_a_bag_is_read_at_the_samples_of_its_sensor(tmp_path: Path) -> None:
    """An IMU at the rate of the joints and a probe at half of it, as a board publishes them."""
    run = drives.recorded(drives.scene(), noise=0.0)
    said = []
    for row, t in enumerate(run["t"]):
        time = round(1e9 * t)
        angle, speed = np.radians(run["encoder"][row]), run["rpm"][row] * np.pi / 30.0
        joint = JointSample(time, angle, speed, (), (), (), None, "")
        said.append(("/joint_states", time, encoded(JOINT_STATES, joint)))
        place = 1e-3 * run["ch1"][row], 1e-3 * run["ch2"][row], 0.0
        felt = ImuSample(time, tuple(1e4 * x for x in place), 0.0, "imu_link")
        said.append(("/imu/data_raw", time, encoded(IMU, felt)))
        if row % 2 == 0:
            said.append(("/displacement", time, encoded(PROBE, WhirlSample(time, place, "eddy"))))
    bag = bag_of(tmp_path / "rig", said)
    imu = measured_of(bag, drives.scene())
    assert (imu.kind, imu.sensor, len(imu.time)) == ("acceleration", None, len(run["t"]) - 1)
    eddy = measured_of(bag, drives.scene(), signal="eddy")
    assert (eddy.kind, eddy.notes) == ("displacement", ())
    assert eddy.signals[:, 0] == pytest.approx(1e-3 * run["ch1"][2::2], rel=1e-12)
    with pytest.raises(InputError, match="signal 'nose': .*imu_link, eddy"):
        measured_of(bag, drives.scene(), signal="nose")


def pulse_train(angle: np.ndarray, logic: bool) -> np.ndarray:
    """Reading of a mark that passes once a turn: logic levels, or a smooth peak in volts."""
    if logic:
        return (np.mod(angle, 2.0 * np.pi) < 1.0).astype(float)
    return 5.0 / (1.0 + np.exp(-8.0 * (np.cos(angle + 1.0) - 0.8)))


def keyphasor_map(tmp_path: Path, words: str = "") -> Any:
    lines = [each for each in drives.MAP.splitlines() if "rpm" not in each]
    text = "\n".join(lines).replace(
        "angle: {column: encoder, unit: deg}", f"keyphasor: {{column: pulses{words}}}"
    )
    return read_mapping_file(drives.mapping(tmp_path, text))


@pytest.mark.parametrize(("logic", "off"), [(False, 0.01), (True, 0.15)])
def test_pulses_tell_the_angle(tmp_path: Path, logic: bool, off: float) -> None:
    """Logic levels are known to a sample only: 0.18 rad at 180 rad/s."""
    run = drives.recorded(drives.scene(), noise=0.0)
    angle = np.radians(run["encoder"])
    pulses = pulse_train(angle, logic)
    found = angle_from_pulses(run["t"], pulses, 1, "bench")
    there = np.isfinite(found)
    wrong = found[there] - angle[there]
    assert np.abs(wrong - np.median(wrong)).max() < off
    file = drives.write({**run, "pulses": pulses}, tmp_path / "bench.csv")
    measured = measured_of(file, drives.scene(), keyphasor_map(tmp_path))
    assert measured.free == ("disc_angle",) and not measured.at_rest
    assert f"{np.sum(~there)} samples before the first pulse and after" in measured.notes[0]
    assert measured.spindle_angle == pytest.approx(found[there][1:], abs=1e-3)
    known = measured_of(file, drives.scene(), keyphasor_map(tmp_path, ", angle: 30 deg"))
    assert known.free == ()
    assert known.schedule.angle(0.0) == pytest.approx(np.pi / 6.0 + found[there][0], abs=1e-3)


def test_a_missing_pulse_is_told(tmp_path: Path) -> None:
    angle = 0.1 * np.arange(4000.0)
    pulses = pulse_train(angle, logic=True)
    pulses[(angle > 20 * np.pi) & (angle < 21 * np.pi)] = 0.0
    with pytest.raises(InputError, match="0.5655 s .*next pulse .* 0.126 s"):
        angle_from_pulses(1e-3 * np.arange(4000.0), pulses, 1, "bench")
    with pytest.raises(InputError, match="has 0 pulses; .* 10"):
        angle_from_pulses(1e-3 * np.arange(4000.0), 0.0 * pulses, 1, "bench")
    with pytest.raises(InputError, match="angle or keyphasor"):
        read_mapping_file(drives.mapping(tmp_path, drives.MAP + "keyphasor: {column: rpm}\n"))


@pytest.mark.parametrize("per_turn", [4.5, 20.0, 200.0])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.3])
def test_spikes_are_told_from_a_whirl_and_noise(per_turn: float, noise: float) -> None:
    """Over a resonance, where most of the recording is quiet."""
    at = np.arange(4000.0)
    whirl = np.exp(-(((at - 2000.0) / 600.0) ** 2)) * np.sin(2.0 * np.pi / per_turn * at)
    values = np.concatenate([np.zeros(500), whirl + noise * FLUTTER])
    assert spikes_in(values).tolist() == []
    assert spikes_in(np.round(5.0 * values)).tolist() == []
    values[[700, 701, 2500, 3999]] = 9.0, -8.0, 1e6, -9.0
    values[3000] = np.nan
    assert spikes_in(values).tolist() == [700, 701, 2500, 3999]


def test_spikes_are_left_out_and_named(tmp_path: Path) -> None:
    table = drives.recorded(drives.scene())
    spiky = {**table, "ch1": table["ch1"].copy()}
    spiky["ch1"][[400, 900]] = 1e6, -50.0
    file = drives.write(spiky, tmp_path / "bench.csv")
    found = measured_of(file, drives.scene(), read_mapping_file(drives.mapping(tmp_path)))
    assert found.notes[0] == (
        "2 spikes in ch1 left out, the first at row 400: is its line disturbed?"
    )
    assert np.nanmax(np.abs(found.signals)) < 2e-3

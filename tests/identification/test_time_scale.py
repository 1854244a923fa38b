"""A sampling rate that is off, and one signal of a run that does not begin at rest."""

from pathlib import Path

import numpy as np
import pytest

from ab_sim.identification.files import measured_of
from ab_sim.identification.mapping import mapping_of
from ab_sim.identification.measured import Measured
from ab_sim.identification.missing import scaled
from ab_sim.identification.parameters import recording_parameters
from ab_sim.identification.run import IdentificationSettings, run_identification
from tests.identification import drives

KEYS = ("effects.suspension.stiffness", "effects.suspension.damping", "rotor.eccentricity")
SIGNALS = [{"column": "ch1", "unit": "mm"}, {"column": "ch2", "unit": "mm"}]
SPEED = {"column": "rpm", "unit": "rpm"}


def recording(folder: Path, balls: bool = False, **mapping: object) -> Measured:
    run = drives.recorded(drives.scene(), balls)
    file = drives.write(run, folder / "bench.csv")
    raw = {"speed": SPEED, "signals": SIGNALS, "balls": balls, **mapping}
    return measured_of(file, drives.scene(), mapping_of(raw, "map"))


@pytest.mark.parametrize("rate", [1.0005, 0.93])
def test_a_sampling_rate_that_is_off_is_named(tmp_path: Path, rate: float) -> None:
    """0.05 to 7 %, of a drive whose speed alone was recorded."""
    wrong = recording(tmp_path, sampling=f"{rate} kHz")
    start = drives.scene(dict(zip(KEYS, (1200.0, 1.5, 8e-5), strict=True)))
    found = run_identification(start, [wrong], IdentificationSettings(KEYS, propose=False))
    (tried,) = found.tried
    assert tried.values["time scale of bench"] == pytest.approx(rate, abs=1e-4)
    assert tried.z < 4.0
    assert any("is the sampling rate, or the speed's unit" in each for each in found.reasons)
    assert not any("changed or broken" in each for each in found.reasons)


def test_a_scaled_recording_turns_as_fast_for_longer(tmp_path: Path) -> None:
    one = recording(tmp_path, sampling="1 kHz")
    other = scaled(one, 1.25)
    assert other.duration == pytest.approx(1.25 * one.duration)
    assert other.spindle_angle == pytest.approx(1.25 * one.spindle_angle, rel=1e-9)
    assert other.schedule.top_speed == pytest.approx(one.schedule.top_speed)


@pytest.mark.parametrize(
    ("directions", "seen"), [([0.0], "x"), ([1.5], "y"), ([-3.0], "x"), ([0.0, 1.6], "xy")]
)
def test_the_start_across_a_single_signal_is_not_fitted(
    tmp_path: Path, directions: list[float], seen: str
) -> None:
    signals = [
        {**each, "direction": direction}
        for each, direction in zip(SIGNALS, directions, strict=False)
    ]
    measured = recording(
        tmp_path, signals=signals, time={"column": "t", "unit": "s"}, at_rest=False
    )
    names = {each.name for each in recording_parameters(drives.scene(), measured, 0)}
    wanted = {f"start {what}{axis} of bench" for what in ("", "v") for axis in seen}
    assert {name for name in names if name.startswith("start ")} == wanted
    said = [note for note in measured.notes if "the deck's start across it is not known" in note]
    assert len(said) == (len(seen) == 1)
    assert np.isfinite(measured.rms)

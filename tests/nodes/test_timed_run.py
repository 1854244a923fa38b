"""Profiles by a clock that leaps, into a snapshot and out of it, and files that are none."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from ab_sim.base.errors import InputError
from ab_sim.nodes.adaptive_execution import (
    SPINDLE_SILENT,
    AdaptiveExecution,
    Reading,
    SpindleSample,
)
from ab_sim.nodes.profile_interface import log_text
from ab_sim.nodes.timed_run import (
    CheckedProfile,
    TimedRun,
    read_profile_snapshot,
    write_profile_snapshot,
)
from ab_sim.scene.load import load_profile

PERIOD, MS = 0.005, 1_000_000
SLOW = "{kind: segments, segments: [{to: 100, acceleration: 50}]}"
ADAPTIVE = "adaptive-start-up"


def planned(source: str, *changes: str, period: float = PERIOD) -> CheckedProfile:
    return CheckedProfile(load_profile(source, changes), source, [*changes], period)


class Bench:
    """A controller, whose drive's clock is at some ms."""

    def __init__(self, simulated: bool = True) -> None:
        self.said: list[str] = []
        self.warned: list[str] = []
        self.timed = TimedRun(
            PERIOD, simulated, lambda status, well: self.said.append(status), self.warned.append
        )
        self.now = 0

    def start(self, source: str = SLOW) -> str:
        return self.timed.start(self.now * MS, planned(source), 1.0, 50.0)

    def to(self, now: int, by: int = 4) -> list[float]:
        """The clock goes on; what is commanded meanwhile."""
        told = []
        while self.now < now:
            self.now += by
            told.append(self.timed.tick(self.now * MS, 0.004))
        return [speed for speed in told if speed is not None]

    def leap(self, now: int) -> float | None:
        self.now = now
        return self.timed.tick(now * MS, 0.004)


def test_a_command_each_period_of_simulated_time() -> None:
    bench = Bench()
    assert bench.to(100) == [] and bench.start() == ""
    told = bench.to(1100)
    assert len(told) == 200, "of 250 wake-ups"
    assert told[-1] == pytest.approx(50.0 * 1.005)
    assert [bench.leap(bench.now) for _ in range(3)] == [None] * 3, "time stands still"


def test_time_that_leaps() -> None:
    bench = Bench()
    assert bench.start() == ""
    bench.to(1000)
    assert bench.leap(500) == 0.0 and bench.timed.run.state.value == "aborted"
    assert bench.warned == ["time jumped from 1 to 0.5 s"]
    assert bench.start() == ""
    bench.to(900)
    bench.leap(9000)
    assert bench.timed.run.state.value == "aborting", "a ramp down"


def snapshot_of(bench: Bench, path: Path) -> Any:
    write_profile_snapshot(path, bench.timed.snapshot())
    return read_profile_snapshot(path)


@pytest.mark.parametrize("later", [1000, 1500, 200])
def test_it_goes_on_when_the_drive_is_where_it_was(tmp_path: Path, later: int) -> None:
    """Put back before its drive is: at the same time, at a later one, or in new processes."""
    bench = Bench()
    assert bench.start() == ""
    bench.to(1000)
    last = bench.timed.run.commanded
    kept = snapshot_of(bench, tmp_path / "kept.json")
    expected = bench.to(2400)
    again = Bench()
    again.now = later
    again.timed.restore(later * MS, kept, planned(SLOW), 1.0)
    assert again.said[-1] == bench.said[-2]
    if later != 1000:
        assert again.leap(later + 8 if later > 1000 else later + 8) is None and again.timed.waits
        assert again.timed.execution is None, "and hears nothing meanwhile"
    assert again.leap(1000) == last, "the last command, once more"
    assert not again.timed.waits and again.timed.execution is not None
    assert again.to(2400) == expected
    assert again.said[-1] == "done"


def restored(tmp_path: Path) -> Bench:
    """Return a run that was restored to a snapshot of 0.2 s ago, and waits for the drive."""
    bench = Bench()
    assert bench.start() == ""
    bench.to(1000)
    kept = snapshot_of(bench, tmp_path / "kept.json")
    bench.to(1200)
    bench.timed.restore(bench.now * MS, kept, planned(SLOW), 1.0)
    return bench


def test_a_drive_that_is_reset_instead_is_no_drive_that_was_put_back(tmp_path: Path) -> None:
    bench = restored(tmp_path)
    assert bench.leap(0) == 0.0 and bench.timed.run.state.value == "aborted"


def test_who_aborts_does_not_wait_for_the_drive(tmp_path: Path) -> None:
    bench = restored(tmp_path)
    assert bench.to(1300) == [] and bench.timed.waits
    assert bench.timed.abort(bench.now * MS, "by hand") == "" and not bench.timed.waits
    told = bench.to(2400)
    assert (
        told[0] < 50.25 and told[-1] == 0.0 and bench.said[-2:] == ["aborting: by hand", "aborted"]
    )


def test_before_the_first_profile(tmp_path: Path) -> None:
    bench = Bench()
    kept = snapshot_of(bench, tmp_path / "kept.json")
    assert bench.start() == ""
    bench.to(500)
    bench.timed.restore(bench.now * MS, kept, None, 1.0)
    assert bench.leap(0) is None and bench.timed.run.status == "idle"


def test_what_is_no_snapshot_of_that_profile(tmp_path: Path) -> None:
    bench, path = Bench(), tmp_path / "kept.json"
    assert bench.start(ADAPTIVE) == ""
    bench.to(500)
    kept = snapshot_of(bench, path)
    status, text = bench.timed.run.status, path.read_text()
    other = planned(ADAPTIVE, "sensors.pick_up.axis_angle=0.1")
    numbers = {**kept.run, "execution": {**kept.run["execution"], "numbers": [1.0, math.nan]}}
    for snapshot, plan, words in (
        (kept, other, "has changed since"),
        (kept._replace(run=numbers), planned(ADAPTIVE), "its profile is invalid"),
        (kept._replace(run={}), planned(ADAPTIVE), "its profile is invalid"),
        (kept._replace(run={**kept.run, "state": "asleep"}), planned(ADAPTIVE), "'asleep'"),
    ):
        with pytest.raises(InputError, match=words):
            bench.timed.restore(0, snapshot, plan, 1.0)
    assert bench.timed.run.status == status and not bench.timed.waits, "nothing has changed"
    for damage, words in (
        (text[:200], "damaged, or not"),
        ("{}", "of a profile controller"),
        (json.dumps({**json.loads(text), "ab_sim": "0.0.1"}), "is of ab_sim 0.0.1"),
        (json.dumps({**json.loads(text), "time": "noon"}), "is damaged"),
    ):
        path.write_text(damage)
        with pytest.raises(InputError, match=words):
            read_profile_snapshot(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_profile_snapshot(tmp_path / "none.json")
    with pytest.raises(InputError, match=r"must end in \.json"):
        write_profile_snapshot(tmp_path / "kept.txt", kept)


def test_an_adaptive_start_up_has_a_period_of_its_own() -> None:
    with pytest.raises(InputError, match=r"command_period = 0.005 s.*command_rate = 200 "):
        planned(ADAPTIVE, period=0.01)
    alone = planned("{kind: adaptive, target_speed: 200, acceleration: 100, sensor: imu}")
    assert alone.inputs == planned(ADAPTIVE).inputs._replace(sensor="imu")
    assert alone.steepest == 100.0


@pytest.mark.parametrize("silent", ["spindle", "sensor"])
def test_an_adaptive_start_up_says_which_topic_is_silent(silent: str) -> None:
    bench = Bench()
    assert bench.start(ADAPTIVE) == ""
    for now in range(1, 1001):
        execution = bench.timed.execution
        assert isinstance(execution, AdaptiveExecution)
        t = now * 1e-3
        if silent != "spindle" or now < 300:
            execution.spindle(SpindleSample(now * MS, 20.0 * t * t, 40.0 * t))
        if silent != "sensor" or now < 300:
            execution.reading(Reading(now * MS, math.sin(37.0 * t), math.cos(37.0 * t)))
        bench.to(now, 1)
    why = next(text for text in bench.said if text.startswith("aborting: "))
    assert "no valid sample" in why and (SPINDLE_SILENT in why) is (silent == "spindle")


def test_words_of_one_that_gave_up_do_not_contradict_themselves() -> None:
    gave_up = log_text("done: gave up: net unbalance 3 um", well=False)
    assert gave_up == "at the final speed, but gave up: net unbalance 3 um"
    assert log_text("done: 3 um") == "profile done, holding its final speed; 3 um"

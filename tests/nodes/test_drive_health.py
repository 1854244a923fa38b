"""What a drive says of its pace, with a clock of the test's own."""

import pytest

from ab_sim.drive import Drive
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.nodes.drive_health import DriveHealth, RealTimeTolerance
from ab_sim.nodes.pacing import Pacer
from ab_sim.scene import load_scene


@pytest.fixture
def drive() -> Drive:
    return Drive(load_scene("thesis-hold"), commanded=True)


def watched(drive: Drive, factor: float = 0.05, lateness: float = 0.1) -> tuple[DriveHealth, Pacer]:
    pacer = Pacer(drive.step, 4, 40, 60.0)
    pacer.start(100.0)
    health = DriveHealth(drive, pacer, None, RealTimeTolerance(factor, lateness))
    health.begin(100.0)
    return health, pacer


def test_says_nothing_of_a_pace_not_measured_yet(drive: Drive) -> None:
    health, _ = watched(drive)
    drive.advance(400)
    assert not health.period_over(100.4, paused=False)
    assert health.state(paused=False) == "running"
    assert health.warnings() == []
    assert "real-time factor" not in health.values()


def test_on_pace(drive: Drive) -> None:
    health, _ = watched(drive)
    drive.advance(980)
    assert health.period_over(101.0, paused=False)
    assert health.state(paused=False) == "running in real time"
    assert health.warnings() == []
    assert health.values()["real-time factor"] == "0.9800"


@pytest.mark.parametrize(("steps", "factor"), [(200, "0.200"), (1300, "1.300")])
def test_off_pace_is_not_called_real_time(drive: Drive, steps: int, factor: str) -> None:
    health, _ = watched(drive)
    drive.advance(steps)
    health.period_over(101.0, paused=False)
    assert health.state(paused=False) == "running"
    assert health.warnings() == [f"not in real time: factor {factor}"]


def test_longer_windows(drive: Drive) -> None:
    health, _ = watched(drive)
    for second in range(1, 12):
        drive.advance(900 if second < 6 else 1000)
        assert health.period_over(100.0 + second, paused=False)
        assert ("real-time factor, 10 s" in health.values()) == (second >= 10)
    assert health.values()["real-time factor, 10 s"] == "0.96000"


def test_at_another_speed(drive: Drive) -> None:
    health, pacer = watched(drive)
    pacer.start(100.0, 2.0)
    drive.advance(1980)
    health.period_over(101.0, paused=False)
    assert health.state(paused=False) == "running at 2 times real time" and health.warnings() == []
    drive.advance(1000)
    health.period_over(102.0, paused=False)
    assert health.warnings() == ["not at 2 times real time: factor 1.000"]
    health.paced = False
    assert health.warnings() == [] and health.state(paused=False) == "running as fast as possible"


def test_how_far_off_is_a_parameter(drive: Drive) -> None:
    health, _ = watched(drive, factor=0.5)
    drive.advance(600)
    health.period_over(101.0, paused=False)
    assert health.state(paused=False) == "running in real time"


def test_a_pause_has_no_pace(drive: Drive) -> None:
    health, _ = watched(drive)
    drive.advance(1000)
    health.period_over(101.0, paused=False)
    health.begin(101.5)
    assert health.period_over(102.5, paused=True)
    assert health.state(paused=True) == "paused"
    assert health.warnings() == []
    assert "real-time factor" not in health.values()


@pytest.mark.parametrize(("lateness", "expected"), [(0.1, ["a wake-up was 0.296 s late"]), (1, [])])
def test_lateness_is_news_once(drive: Drive, lateness: float, expected: list[str]) -> None:
    health, pacer = watched(drive, lateness=lateness)
    pacer.due(100.3)
    assert health.warnings() == expected
    assert health.warnings() == []
    assert health.values()["worst lateness [s]"] == "0.296000", "over the node's life"


def test_steps_lost_to_a_pause_are_news(drive: Drive) -> None:
    health, pacer = watched(drive, lateness=60.0)
    pacer.stop(102.0)
    pacer.start(200.0)
    assert health.warnings() == ["fell behind: 1960 steps were dropped"]
    assert health.values()["steps dropped"] == "1960"


def test_a_stepper_that_was_measured_says_at_what_price() -> None:
    scene, work_precision = resolve_accuracy(
        load_scene("no-ball", ["accuracy.whirl=1e-3", "duration=0.2"]), commanded=True
    )
    assert work_precision is not None
    drive = Drive(scene, commanded=True)
    pacer, tolerance = Pacer(drive.step, 4, 40, 60.0), RealTimeTolerance(0.05, 0.1)
    assert (
        DriveHealth(drive, pacer, None, tolerance, work_precision).stepper_chosen
        == work_precision.reason
    )
    assert DriveHealth(drive, pacer, None, tolerance).stepper_chosen == drive.choice.reason


def test_balls_that_overlap_are_named_from_when_they_do() -> None:
    """Looked at once a report."""
    drive = Drive(load_scene("thesis-hold", ["start.ball_angles=[0,1]"]), commanded=True)
    health, _ = watched(drive)
    assert health.values()["balls overlap"] == "no"
    together = Drive(load_scene("thesis-hold"), commanded=True)
    together.advance(2)
    assert watched(together)[0].values()["balls overlap"] == "balls 0 and 1, first at 0.002 s"
    alone = Drive(load_scene("one-ball"), commanded=True)
    assert "balls overlap" not in watched(alone)[0].values()


def test_after_a_reset_overlaps_count_anew(drive: Drive) -> None:
    health, _ = watched(drive)
    drive.advance(5)
    assert health.values()["balls overlap"] == "balls 0 and 1, first at 0.005 s"
    drive.reset()
    assert health.values()["balls overlap"] == "balls 0 and 1, first at 0 s"

"""A drive whose start-up a controller leads: the same bits as the controller and drive by hand."""

from typing import Any

import numpy as np
import pytest

from ab_sim import Drive, Scene, load_scene
from ab_sim.analysis.startup import net_unbalance
from ab_sim.base.errors import CommandError
from ab_sim.control import StartUp, State
from ab_sim.drive.controllers import AdaptiveController, settings_of
from ab_sim.drive.faults.fault import faults_of
from ab_sim.drive.snapshot_file import read_snapshot, write_snapshot
from tests.conftest import SceneMaker

STEPS = 2000
"""Past the run-up and some decisions."""


@pytest.fixture(scope="module")
def adaptive() -> Scene:
    return load_scene("adaptive-start-up", ["sensors.pick_up.axis_angle=0.4"])


def led(scene: Scene, steps: int = STEPS, faults: tuple[str, ...] = ()) -> Drive:
    drive = Drive(scene, faults=faults_of(faults))
    drive.advance(steps)
    return drive


def run_of(drive: Drive) -> AdaptiveController:
    assert isinstance(drive.controller, AdaptiveController)
    return drive.controller


def by_hand(scene: Scene, steps: int) -> tuple[np.ndarray, StartUp]:
    """What firmware would do: a command each 5 ms, of all samples up to then."""
    drive, start_up = Drive(scene, commanded=True), StartUp(settings_of(scene))
    rows = []
    for step in range(steps + 1):
        time = step * 1_000_000 * 1e-9
        if step:
            run = drive.advance()
            rows.append(run.samples[0])
            shown = (run[name][0] for name in ("angle", "speed", "pick_up_1", "pick_up_2"))
            start_up.sample(time, *map(float, shown))
        if step % 5 == 0:
            speed = start_up.command(time)
            if start_up.state is not State.WAITING:
                drive.command(speed)
    return np.array(rows), start_up


def test_it_is_the_controller_and_the_drive_by_hand(adaptive: Scene) -> None:
    drive = Drive(adaptive)
    run = drive.advance(STEPS)
    rows, start_up = by_hand(adaptive, STEPS)
    assert run.samples.tobytes() == rows.tobytes()
    assert np.array(run_of(drive).state).tobytes() == np.array(start_up.state_numbers()).tobytes()
    assert run_of(drive).decisions[-1].text == start_up.decision.text
    assert len(run_of(drive).decisions) == start_up.decision.number > 1
    assert [each.time for each in run_of(drive).history[:3]] == [0.0, 0.005, 0.01]
    assert len(run_of(drive).history) == STEPS // 5 + 1


@pytest.mark.parametrize("pieces", [(1, 3, 7, 989), (999, 1)])
def test_pieces_and_looks_between_do_not_matter(adaptive: Scene, pieces: tuple[int, ...]) -> None:
    whole, drive, taken = Drive(adaptive).advance(STEPS + 1000), Drive(adaptive), []
    while drive.steps < STEPS:
        for piece in pieces:
            taken.append(drive.advance(piece).samples)
            drive.observe()
            drive.observe_at(drive.time + 0.5 * drive.step)
    assert np.vstack(taken).tobytes() == whole.samples[: drive.steps].tobytes()
    every = Drive(adaptive).advance(STEPS, every=4)
    assert every.samples.tobytes() == whole.samples[3:STEPS:4].tobytes()


def test_observing_within_a_step_is_what_the_step_comes_to(adaptive: Scene) -> None:
    drive = led(adaptive, 1000)  # a command is due at this step
    ahead = drive.observe_at(drive.time + drive.step)
    assert ahead.omega == pytest.approx(drive.advance()["speed"][-1], rel=1e-14)
    assert ahead.command == drive.present()["command"][0]


def test_a_snapshot_goes_on_to_the_same_bits(adaptive: Scene, tmp_path: Any) -> None:
    drive = led(adaptive, 1503)
    write_snapshot(tmp_path / "kept.json", adaptive, kept := drive.snapshot(), {})
    after = drive.advance(1000).samples.tobytes()
    for snapshot in (kept, read_snapshot(tmp_path / "kept.json", adaptive)[0]):
        for other in (drive, Drive(adaptive, commanded=True)):
            other.restore(snapshot)
            assert other.advance(1000).samples.tobytes() == after
    drive.reset()
    assert drive.advance(200).samples.tobytes() == Drive(adaptive).advance(200).samples.tobytes()


def test_a_snapshot_of_no_such_start_up_is_refused(adaptive: Scene, scene: SceneMaker) -> None:
    drive = led(adaptive, 50)
    for numbers, words in (((1.0,), "numbers"), ((float("nan"),) * 500, "numbers")):
        with pytest.raises(ValueError, match=words):
            drive.restore(drive.snapshot()._replace(controller=numbers))
    plain = Drive(scene())
    with pytest.raises(ValueError, match="with a profile controller"):
        plain.restore(plain.snapshot()._replace(controller=drive.snapshot().controller))
    assert plain.steps == 0 and drive.steps == 50


def test_a_command_takes_over_and_one_that_is_refused_does_not(adaptive: Scene) -> None:
    drive = led(adaptive, 500)
    with pytest.raises(CommandError):
        drive.command(1000.0)
    assert drive.controller is not None
    drive.command(20.0)
    assert drive.controller is None and drive.advance(1000)["speed"][-1] == 20.0
    held = Drive(adaptive, commanded=True)
    assert held.controller is None and held.advance(100)["speed"][-1] == 0.0


def test_it_begins_at_the_speed_that_there_is(adaptive: Scene) -> None:
    scene = load_scene("adaptive-start-up", ["start.speed=50"])
    speed = Drive(scene).advance(100)["speed"]
    assert speed.min() == 50.0 and speed[4] == 50.0 and speed[99] > 65.0


def test_sensors_are_heard_at_their_own_rate(adaptive: Scene) -> None:
    """Half of the samples: the controller is led by other readings, and not by those between."""
    slower = ["solver.step=0.0005", "profile.command_period=0.0025"]
    scene = load_scene("adaptive-start-up", slower)
    drive, start_up = Drive(scene), StartUp(settings_of(scene))
    run = drive.advance(101)
    for step in range(101):
        if step and step % 2 == 0:
            row = [float(run[name][step - 1]) for name in ("angle", "speed", "pick_up_1")]
            start_up.sample(step * 500_000 * 1e-9, *row, float(run["pick_up_2"][step - 1]))
        if step % 5 == 0:
            start_up.command(step * 500_000 * 1e-9)
    assert run_of(drive).state == start_up.state_numbers()


@pytest.mark.parametrize("fault", ["pick_up drops", "spindle drops"])
def test_a_sensor_that_is_never_heard_leaves_it_waiting(adaptive: Scene, fault: str) -> None:
    drive = led(adaptive, 2000, (fault,))
    assert run_of(drive).start_up.state is State.WAITING
    assert drive.observe().omega == 0.0


def judged(drive: Drive) -> State:
    """How a start-up ends: aborted and standing still, or safely at its final speed."""
    controller, scene = run_of(drive).start_up, drive.scene
    unbalance = scene.eccentric_mass * scene.rotor.eccentricity
    worst = unbalance + scene.balls.total_mass * scene.race.radius
    critical, damping = scene.critical_speed, scene.effects["suspension"].damping
    assert critical is not None
    while not controller.state.over:
        run = drive.advance(1000)
        # Held at the critical speed with all balls where they add to it, it were twice as large.
        assert run.whirl.max() < 0.5 * worst * critical / damping and drive.time < 20.0
    if controller.state is State.ABORTED:
        assert run["speed"][-1] == 0.0 and len(controller.reason.split()) > 3
        assert controller.reason in run_of(drive).decisions[-2].text
    else:
        assert controller.state is State.DONE and run["speed"][-1] == pytest.approx(200.0)
        assert net_unbalance(run, scene)[-1] < 0.7 * unbalance / scene.total_mass
    return controller.state


@pytest.mark.parametrize(
    "fault",
    ["pick_up drops 0.5", "pick_up saturates 2", "pick_up drifts 5", "pick_up turned 2",
     "spindle saturates 30"],
)  # fmt: skip
def test_a_faulty_sensor_ends_in_a_clear_abort_or_a_safe_start_up(
    adaptive: Scene, fault: str
) -> None:
    state = judged(Drive(adaptive, faults=faults_of([fault])))
    assert state is State.ABORTED or fault.startswith("pick_up")


@pytest.mark.parametrize(
    ("fault", "aborts"),
    [("pick_up drops", True), ("pick_up turned 1.6", False)],
)
def test_a_sensor_that_fails_while_it_dwells(adaptive: Scene, fault: str, aborts: bool) -> None:
    sound = led(adaptive, 900)
    assert run_of(sound).start_up.state is State.DWELL
    drive = Drive(adaptive, faults=faults_of([fault]))
    drive.restore(sound.snapshot())
    assert (judged(drive) is State.ABORTED) is aborts


def test_a_speed_that_drifts_leads_it_nowhere(adaptive: Scene) -> None:
    """Neither backwards nor beyond the final speed, whatever the speed is said to be."""
    for fault in ("spindle drifts -5", "spindle drifts 5"):
        run = Drive(adaptive, faults=faults_of([fault])).advance(6000)
        assert run["command"].min() >= 0.0 and run["command"].max() <= 200.0
        assert run["speed"].min() >= 0.0


def test_what_the_spindle_may_not_do_is_not_followed(
    adaptive: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As live: the drive refuses a command beyond its limits, and stays as it was."""
    drive = led(adaptive, 400)
    before = drive.snapshot().command
    monkeypatch.setattr(StartUp, "command", lambda *_: 1e4)
    drive.advance(5)
    assert drive.snapshot().command == before and drive.controller is not None


def test_faults_change_what_it_hears_and_not_what_there_is(adaptive: Scene) -> None:
    sound, drifting = led(adaptive, 400), led(adaptive, 400, ("pick_up drifts 5",))
    assert run_of(sound).state != run_of(drifting).state
    assert sound.present()["pick_up_1"] == drifting.present()["pick_up_1"]

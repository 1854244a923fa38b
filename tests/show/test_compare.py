"""Recordings beside the scene that they are of, and beside others."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis import run_scene
from ab_sim.analysis.comparison import without_balls
from ab_sim.api.runs import save_recording
from ab_sim.base import palette
from ab_sim.base.errors import InputError
from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording import Recording, open_recording
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.load import changed_scene
from ab_sim.show.compare import COMMANDS, PROFILE, RecordingComparison, compare_recording
from ab_sim.show.curves import in_degrees
from ab_sim.show.gather import gather
from ab_sim.show.panels import panels_of
from ab_sim.show.styles import ball_styles

NAME = "balanced-start-up"


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(NAME, ["duration=1.5"])


@pytest.fixture(scope="module")
def live(scene: Scene) -> Trajectory:
    """Commanded every 7 steps, after a while of none."""
    drive = Drive(scene, commanded=True)
    parts = [drive.present(), drive.advance(50)]
    for k in range(200):
        drive.command(min(0.7 * k, 110.0))
        parts.append(drive.advance(7))
    return Trajectory.join(parts)


def beside(
    path: Path, scene: Scene, run: Trajectory, told: dict[str, Any] | None = None
) -> RecordingComparison:
    with Recording(path, description=told or describe(scene)) as recording:
        recording.block(run.channels, run.samples)
    return compare_recording(open_recording(path), scene)


def part(run: Trajectory, rows: Any) -> Trajectory:
    return Trajectory(run.channels, run.samples[rows])


def test_a_live_run_is_the_same_to_the_bit(tmp_path: Path, scene: Scene, live: Trajectory) -> None:
    found = beside(tmp_path / "r.rrd", scene, live)
    assert found.same and found.driven_by == COMMANDS and not found.notes
    assert [each.channel for each in found.deviations] == list(
        live.channels[2:4] + live.channels[5:]
    )
    assert found.not_compared == {
        "samples are aligned by it": ("step", "time"),
        "the scene follows it": ("command",),
    }
    assert all(each.largest == each.rms == 0.0 for each in found.deviations)


def test_an_offline_run_is_the_same_to_the_bit(tmp_path: Path, scene: Scene) -> None:
    drive = Drive(scene)
    found = beside(
        tmp_path / "r.rrd", scene, Trajectory.join([drive.present(), drive.advance(1500)])
    )
    assert found.same and found.driven_by == PROFILE


def test_a_run_whose_measurements_decided_is_the_same_to_the_bit(tmp_path: Path) -> None:
    """Its first sample accelerates already; one with other decisions obeys recorded commands."""
    quiet = "{vibration_rms_above: 1, over: 0.05, at_most: 0.5}"
    segments = f"[{{to: 20, acceleration: 40}}, {{until: {quiet}}}, {{to: 60, acceleration: 40}}]"
    profile = f"profile={{kind: segments, segments: {segments}}}"
    changes = [profile, "duration=1.5", "sensors.pickup={}"]
    scene = load_scene("thesis-hold", changes)
    run = run_scene(scene)
    file = tmp_path / "led.rrd"
    save_recording(run, file)
    found = compare_recording(file, scene)
    assert found.same and found.driven_by == PROFILE
    earlier = load_scene("thesis-hold", [profile.replace("0.5}", "0.4}"), *changes[1:]])
    assert compare_recording(file, earlier).driven_by == COMMANDS


def test_one_that_began_before_any_command_is_the_same(
    tmp_path: Path, scene: Scene, live: Trajectory
) -> None:
    assert beside(tmp_path / "r.rrd", scene, part(live, slice(30, None))).same


def test_one_that_begins_in_the_middle_goes_on_from_its_first_sample(
    tmp_path: Path, scene: Scene, live: Trajectory
) -> None:
    found = beside(tmp_path / "r.rrd", scene, part(live, slice(1300, None)))
    assert "begins at t = 1.3 s" in found.notes[0]
    for each in found.deviations:
        share = each.relative(each.largest)
        assert share is None or share < 1e-6, each


def test_decimated_where_nothing_is_commanded_is_the_same(
    tmp_path: Path, scene: Scene, live: Trajectory
) -> None:
    found = beside(tmp_path / "r.rrd", scene, part(live, np.r_[0:50:10, 50 : len(live)]))
    assert found.same and "steps are missing" in found.notes[0]


def test_another_scene_is_as_far_as_it_is(tmp_path: Path, scene: Scene, live: Trajectory) -> None:
    other = changed_scene(scene, {"balls.mass": 0.0006}, "test")
    with Recording(tmp_path / "r.rrd", description=describe(scene)) as recording:
        recording.block(live.channels, live.samples)
    found = compare_recording(open_recording(tmp_path / "r.rrd"), other)
    drive = Drive(other, commanded=True)
    parts = [drive.present(), drive.advance(50)]
    for k in range(200):
        drive.command(min(0.7 * k, 110.0))
        parts.append(drive.advance(7))
    off = np.abs(Trajectory.join(parts)["x"] - live["x"])
    (x,) = [each for each in found.deviations if each.channel == "x"]
    assert x.largest == off.max() and x.at == live["time"][off.argmax()]
    assert x.rms == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-12)
    assert x.relative(x.largest) == pytest.approx(off.max() / np.ptp(live["x"]))
    assert not found.same and found.report()["same_to_the_bit"] is False


def test_the_picture_has_ball_angles_in_degrees_in_one_turn(tmp_path: Path, scene: Scene) -> None:
    offline = run_scene(scene).trajectory
    found = beside(
        tmp_path / "run.rrd", changed_scene(scene, {"balls.mass": 0.0006}, "test"), offline
    )
    figure = found.plot()
    by_label = {axes.get_ylabel(): axes for axes in figure.axes}
    assert "speed [rad/s]" in by_label
    recorded, simulated = by_label["ball_0_angle [deg]"].get_lines()
    expected = in_degrees(found.recorded.curve("ball_0_angle")[1])
    np.testing.assert_array_equal(np.asarray(recorded.get_ydata()), expected)
    assert np.nanmin(expected) > -330.0 and np.nanmax(expected) <= 30.0
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["recorded", "simulated"]


def test_a_strangers_recording_is_aligned_by_time(
    tmp_path: Path, scene: Scene, live: Trajectory
) -> None:
    """At times of its own, from another start, at another rate: what a sample shows is met."""
    told = {key: value for key, value in describe(scene).items() if key not in ("step", "stepper")}
    samples = live.samples[::3].copy()
    samples[:, 0] = np.arange(len(samples))
    samples[:, 1] += 1000.0
    found = beside(tmp_path / "r.rrd", scene, Trajectory(live.channels, samples), told)
    assert found.aligned.startswith("by time")
    (speed,) = [each for each in found.deviations if each.channel == "speed"]
    # A command is seen up to 3 steps after it was given.
    assert speed.largest <= 3 * 1e-3 * scene.spindle.max_acceleration
    assert speed.compared == len(samples)


def test_what_cannot_be_compared_says_why(tmp_path: Path, scene: Scene, live: Trajectory) -> None:
    path = tmp_path / "r.rrd"
    with Recording(path, description=describe(scene)) as recording:
        recording.block(live.channels, live.samples)
    with pytest.raises(InputError, match=r"0\.001 s.*solver\.step = 0\.0005 s"):
        compare_recording(open_recording(path), changed_scene(scene, {"solver.step": 5e-4}, "test"))
    with Recording(path, description=describe(scene)):
        pass
    with pytest.raises(InputError, match="compared: it is empty"):
        compare_recording(open_recording(path), scene)
    with pytest.raises(InputError, match="r.rrd: .*recording is empty"):
        gather(open_recording(path), "r")
    names = [name for name in live.channels if name != "command"]
    columns = [live.channels.index(name) for name in names]
    with Recording(path, description=describe(scene)) as recording:
        recording.block(names, live.samples[:, columns])
    with pytest.raises(InputError, match="no channel command"):
        compare_recording(open_recording(path), scene)


def test_what_is_gathered_is_what_the_run_is_judged_by(
    tmp_path: Path, scene: Scene, live: Trajectory
) -> None:
    from ab_sim.analysis import metrics_of

    path = tmp_path / "r.rrd"
    with Recording(path, description=describe(scene)) as recording:
        recording.block(live.channels, live.samples)
        recording.scalar("real_time_factor", 0.5, 0.9)
    data = gather(open_recording(path), "r")
    assert data.metrics is not None and data.scene is not None
    assert data.metrics == metrics_of(live, scene)
    assert data.report()["real_time_factor"] == {"mean": 0.9, "least": 0.9}
    time, angle = data.curves.curve("ball_0_angle")
    np.testing.assert_array_equal(angle, live["ball_0_angle"])
    np.testing.assert_array_equal(time, live["time"])


def test_a_report_shows_the_run_without_balls_in_grey(tmp_path: Path) -> None:
    run = run_scene(load_scene("balanced-start-up", ["duration=2"]))
    path = tmp_path / "r.rrd"
    with Recording(path, description=describe(run.scene)) as recording:
        recording.block(run.trajectory.channels, run.trajectory.samples)
    data = gather(open_recording(path), "r")
    alone = run_scene(without_balls(run.scene))
    assert data.final_without_balls == pytest.approx(alone.metrics.final_whirl, rel=0.01)
    (panel,) = [each for each in panels_of(data) if each.key == "whirl"]
    assert [(line.name, line.colour) for line in panel.curves] == [
        ("without balls", palette.hexadecimal(palette.WITHOUT_BALLS)),
        ("this run", palette.hexadecimal(palette.RUN)),
    ]
    (panel,) = [each for each in panels_of(data) if each.key == "angles"]
    expected = [palette.hexadecimal(palette.ball_colour(ball)) for ball in range(2)]
    assert [line.colour for line in panel.curves] == expected
    assert [style["color"] for style in ball_styles(2)] == expected, "as in the run's picture"


def test_one_that_begins_in_a_ramp_goes_on_in_it(
    tmp_path: Path, scene: Scene, live: Trajectory
) -> None:
    found = beside(tmp_path / "r.rrd", scene, part(live, slice(303, None)))
    for each in found.deviations:
        share = each.relative(each.largest)
        assert share is None or share < 1e-9, each


def test_a_profile_s_run_that_begins_in_a_ramp_is_the_same_to_the_bit(
    tmp_path: Path, scene: Scene
) -> None:
    run = Trajectory.join([(drive := Drive(scene)).present(), drive.advance(900)])
    found = beside(tmp_path / "r.rrd", scene, part(run, slice(300, None)))
    assert found.same and found.driven_by == PROFILE


def test_a_decimated_one_says_that_commands_may_act_late(
    tmp_path: Path, scene: Scene, live: Trajectory
) -> None:
    with Recording(
        tmp_path / "r.rrd", description=describe(scene), every=10, around=0.05
    ) as recording:
        recording.block(live.channels, live.samples)
    found = compare_recording(open_recording(tmp_path / "r.rrd"), scene)
    assert any("left out by intent" in note for note in found.notes)


def test_a_deck_that_does_not_move_has_a_note_in_place_of_a_curve(tmp_path: Path) -> None:
    scene = load_scene("no-ball", ["rotor.eccentricity=0", "duration=0.1"])
    save_recording(run_scene(scene), tmp_path / "still.rrd")
    data = gather(open_recording(tmp_path / "still.rrd"), "still", lambda *_: None)
    (whirl,) = (panel for panel in panels_of(data) if panel.key == "whirl")
    assert whirl.note == "the deck does not move" and not whirl.curves

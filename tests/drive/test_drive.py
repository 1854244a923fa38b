"""A running drive: commands, determinism, snapshots, and clear errors."""

import math
import re
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import CommandError, DivergedError, SceneError
from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory, check_room
from ab_sim.scene import check_scene, load_scene


def test_runs_the_scene_profile_until_commanded(scene: Any) -> None:
    drive = Drive(scene())
    drive.advance(1000)
    assert drive.observe().omega == 40.0
    drive.command(10.0)
    drive.advance(100)
    assert drive.observe().omega == pytest.approx(30.0)
    assert drive.observe().command == 10.0
    drive.advance(1000)
    assert drive.observe().omega == 10.0


def test_commanded_drive_holds_its_start_speed(scene: Any) -> None:
    drive = Drive(scene(start={"speed": 25.0}), commanded=True)
    assert np.all(drive.advance(100)["speed"] == 25.0)


def test_psi_is_continuous_over_commands(scene: Any) -> None:
    drive = Drive(scene(), commanded=True)
    angles = [0.0]
    for command in (30.0, 80.0, -20.0, 5.0, 400.0):
        drive.command(command)
        angles.extend(drive.advance(123)["angle"])
    speeds = np.diff(angles) / drive.step
    assert np.abs(np.diff(speeds)).max() <= 100.0 * drive.step * (1 + 1e-6), "no jump in speed"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 501.0, -501.0])
def test_bad_command_changes_nothing(scene: Any, bad: float) -> None:
    one, other = Drive(scene()), Drive(scene())
    for drive in (one, other):
        drive.advance(100)
        drive.command(50.0)
        drive.advance(50)
    with pytest.raises(CommandError):
        one.command(bad)
    assert one.advance(500).samples.tobytes() == other.advance(500).samples.tobytes()


def test_repeated_command_changes_nothing(scene: Any) -> None:
    one, other = Drive(scene(), commanded=True), Drive(scene(), commanded=True)
    one.command(300.0)
    other.command(300.0)
    again = []
    for _ in range(100):
        other.command(300.0)
        again.append(other.advance(7))
    assert one.advance(700).samples.tobytes() == Trajectory.join(again).samples.tobytes()


@pytest.mark.parametrize(
    ("steps", "every"), [(25_003, 7), (20_000, 20_000), (50_000, 23_456), (5, 9), (0, 3)]
)
def test_keeping_some_steps_only_is_leaving_out_the_others(
    scene: Any, steps: int, every: int
) -> None:
    """Also across the pieces that such a run is taken in."""
    one, other = Drive(scene()), Drive(scene())
    some, all_of_them = one.advance(steps, every), other.advance(steps)
    assert some.samples.tobytes() == all_of_them.samples[every - 1 :: every].tobytes()
    assert one.steps == steps and some.channels == all_of_them.channels


def test_samples_that_do_not_fit_are_refused_before_any_is_taken(scene: Any) -> None:
    drive = Drive(scene())
    with pytest.raises(ValueError, match="at most 16666666 are allowed") as caught:
        drive.advance(10**12)
    assert drive.steps == 0
    named = re.search(r"with every = (\d+) or more", str(caught.value))
    assert named is not None
    check_room(10**12, int(named[1]), drive.channels)
    with pytest.raises(ValueError, match="every = 59999"):
        check_room(10**12, int(named[1]) - 1, drive.channels)


@pytest.mark.parametrize("digits", [400, 5000])
def test_an_int_beyond_all_floats_is_refused_shortly(scene: Any, digits: int) -> None:
    drive, large = Drive(scene()), 10**digits
    for call, allowed in (
        (lambda: drive.advance(large), "at most 16666666 are allowed"),
        (lambda: drive.advance(-large), "must be at least 0"),
        (lambda: drive.advance(1, -large), "must be at least 1"),
        (lambda: drive.observe_at(large), "within the next step"),
    ):
        with pytest.raises(ValueError, match=allowed) as caught:
            call()
        assert len(str(caught.value)) < 1000
    assert len(drive.advance(1, large)) == 0


def test_an_unknown_channel_is_named_with_the_nearest(scene: Any) -> None:
    with pytest.raises(KeyError, match=r"'sped'; did you mean 'speed'\?; .*: step"):
        Drive(scene()).present()["sped"]


@pytest.mark.parametrize("name", ["thesis-hold", "weak-motor", "on-edge"])
def test_with_events_too_it_does_not_matter_how_steps_are_grouped(name: str) -> None:
    """Though within a group a step takes over what the one before has found out."""
    one, other = Drive(load_scene(name)), Drive(load_scene(name))
    whole = one.advance(5000)
    parts = [other.advance(size) for size in [1, 2, 7, 90, 400] * 10]
    assert one.events == other.events > 0
    assert whole.samples.tobytes() == Trajectory.join(parts).samples.tobytes()


def test_same_inputs_same_bits(scene: Any) -> None:
    def run() -> bytes:
        drive = Drive(scene(effects={"rolling_friction": {"arm": 1e-6}}), commanded=True)
        parts = []
        for k in range(50):
            drive.command(4.0 * k)
            parts.append(drive.advance(31))
        return Trajectory.join(parts).samples.tobytes()

    assert run() == run()


def test_reset_and_restore_return_exactly(scene: Any) -> None:
    drive = Drive(scene())
    first = drive.advance(700)
    kept = drive.snapshot()
    second = drive.advance(700)
    drive.command(3.0)
    drive.advance(10)
    drive.restore(kept)
    assert drive.advance(700).samples.tobytes() == second.samples.tobytes()
    drive.reset()
    assert drive.time == 0.0
    assert drive.advance(700).samples.tobytes() == first.samples.tobytes()


def test_snapshot_is_not_touched_by_what_follows(scene: Any) -> None:
    drive = Drive(scene())
    drive.advance(10)
    kept = drive.snapshot()
    before = kept.state.copy()
    drive.advance(500)
    drive.restore(kept)
    drive.advance(500)
    np.testing.assert_array_equal(kept.state, before)


def test_snapshot_of_another_drive_is_refused(scene: Any) -> None:
    with pytest.raises(ValueError, match="other balls, step"):
        Drive(scene()).restore(Drive(scene(balls={"count": 3})).snapshot())


def test_samples_and_observations_agree(scene: Any) -> None:
    drive = Drive(scene(start={"ball_angles": [0.3, -0.9]}))
    row = drive.advance(2400)
    now = drive.present()
    assert now.channels == row.channels
    np.testing.assert_allclose(row.samples[-1], now.samples[0], rtol=1e-12, atol=1e-15)
    seen = drive.observe()
    assert (seen.psi, seen.omega) == (row["angle"][-1], row["speed"][-1])


def test_deck_acceleration_is_the_derivative_of_its_velocity(scene: Any) -> None:
    run = Drive(scene(start={"ball_angles": [0.3, -0.9]})).advance(2500)
    for velocity, acceleration in (("vx", "ax"), ("vy", "ay")):
        slope = np.gradient(run[velocity], 1e-3)[10:-10]
        exact = run[acceleration][10:-10]
        # Central differences miss (w h)^2 / 6 of it at w = 100 rad/s.
        np.testing.assert_allclose(slope, exact, atol=2e-3 * np.abs(exact).max())


def test_observing_between_steps_does_not_disturb(scene: Any) -> None:
    one, other = Drive(scene()), Drive(scene())
    one.advance(2399)
    between = one.observe_at(2.3995)
    fine = Drive(scene(solver={"step": 5e-4}))
    fine.advance(4799)
    np.testing.assert_allclose(between.theta, fine.observe().theta, rtol=1e-9)
    np.testing.assert_allclose(between.u, fine.observe().u, rtol=1e-9)
    one.advance(1)
    other.advance(2400)
    assert one.snapshot().state.tobytes() == other.snapshot().state.tobytes()
    with pytest.raises(ValueError, match="within the next step"):
        one.observe_at(2.5)


def test_divergence_names_variable_time_and_cause(scene: Any) -> None:
    """A whirl of hundreds of race radii: the balls swing faster than a step can follow."""
    drive = Drive(scene(rotor={"eccentricity": 1.0}, race={"radius": 2e-3}))
    with pytest.raises(DivergedError) as caught:
        drive.advance(100_000)
    text = str(caught.value)
    assert "ball_0 rate" in text
    assert "went beyond all bounds at t = 2." in text
    assert "turns more than 3 rad along the race within one step" in text
    assert "try solver.step = 0.00025 s" in text
    assert np.all(np.isfinite(drive.snapshot().state)), "the last good state is kept"
    assert drive.steps > 2000
    drive.reset()
    assert drive.steps == 0


@pytest.mark.parametrize("command", ["fast", None, [1.0]])
def test_commands_that_are_no_numbers(scene: Any, command: Any) -> None:
    with pytest.raises(CommandError, match="must be a number"):
        Drive(scene()).command(command)


def test_breakpoints_next_to_the_grid_and_within_one_step(scene: Any, with_hold: Any) -> None:
    """Off by rounding, a period shorter than a step, and several breakpoints in one step."""

    def final(step: float, start: float, duration: float) -> np.ndarray:
        drive = Drive(
            scene(
                start={"ball_angles": [0.3, -0.9]},
                profile=with_hold(start_time=start, duration=duration),
                solver={"step": step},
            )
        )
        drive.advance(round(2.6 / step))
        return np.append(drive.observe().theta, drive.observe().omega)

    exact = final(1e-3, 2.5, 0.05)
    for start in (2.5 + 1e-13, 2.5 - 1e-13, 2.5 + 3e-16):
        np.testing.assert_allclose(final(1e-3, start, 0.05), exact, rtol=1e-9)
    np.testing.assert_allclose(final(1e-3, 2.5003, 3e-4), final(2.5e-4, 2.5003, 3e-4), rtol=1e-9)


def test_samples_have_the_profiles_angle_and_speed_to_the_bit(scene: Any, with_hold: Any) -> None:
    """Between breakpoints that are off the grid; and the deck lies on axes at just that angle."""
    drive = Drive(scene(profile=with_hold(start_time=2.50033, duration=0.05)))
    drive.advance(2490)
    run, profile = drive.advance(100), drive.schedule
    assert {profile.number_at(time) for time in run["time"]} == {0, 1, 2}
    assert run["angle"].tolist() == [profile.angle(time) for time in run["time"]]
    assert run["speed"].tolist() == [profile.speed(time) for time in run["time"]]
    assert run["command"].tolist() == run["speed"].tolist()
    seen, c, s = drive.observe(), np.cos(run["angle"][-1]), np.sin(run["angle"][-1])
    u1, u2 = drive.snapshot().state[:2]
    np.testing.assert_allclose(seen.position, [c * u1 - s * u2, s * u1 + c * u2], rtol=1e-13)
    assert drive.present().samples.tobytes() == run.samples[-1].tobytes()


def test_a_trajectory_is_not_touched_by_what_follows(scene: Any) -> None:
    drive = Drive(scene())
    run, present = drive.advance(20), drive.present()
    before = run.samples.tobytes(), present.samples.tobytes()
    drive.advance(50)
    drive.command(10.0)
    drive.advance(1)
    drive.reset()
    assert (run.samples.tobytes(), present.samples.tobytes()) == before


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 10, 11])
def test_any_grouping_of_steps_across_breakpoints(count: int, scene: Any) -> None:
    """Breakpoints of commands on and off the grid, met by every phase of the groups of steps."""

    def run(count: int) -> bytes:
        drive = Drive(scene(spindle={"max_acceleration": 50.0}), commanded=True)
        parts = []
        for k in range(24):
            drive.command(0.2 * (k + 1) + 0.0037 * (k % 3))
            left = 110
            while left:
                parts.append(drive.advance(min(count, left)))
                left -= len(parts[-1])
        return Trajectory.join(parts).samples.tobytes()

    assert run(count) == run(110)


def test_command_during_a_raised_cosine(scene: Any) -> None:
    change = {"kind": "speed_change", "start_time": 0.1, "duration": 0.2, "to_speed": 50.0}
    drive = Drive(scene(start={"speed": 100.0}, profile=change))
    before = drive.advance(200)
    assert before["speed"][-1] == pytest.approx(75.0)
    drive.command(90.0)
    after = drive.advance(200)
    assert after["speed"][0] == pytest.approx(75.0 + 0.1)
    assert after["speed"][-1] == 90.0
    steps = np.diff(np.append(before["angle"][-1], after["angle"]))
    assert np.all(np.abs(steps - 1e-3 * 82.5) < 1e-3 * 8.0), "the angle goes on"


def test_observing_across_a_breakpoint(scene: Any, with_hold: Any) -> None:
    drive = Drive(scene(profile=with_hold(start_time=0.1003, duration=1.0)))
    drive.advance(100)
    assert drive.observe_at(0.1002).omega == pytest.approx(4.008)
    assert drive.observe_at(0.1008).omega == pytest.approx(4.012)


def test_advance_refuses_to_go_back(scene: Any) -> None:
    with pytest.raises(ValueError, match="every = 0: .* at least 1"):
        Drive(scene()).advance(1, every=0)
    with pytest.raises(ValueError, match="steps = -1: .* at least 0"):
        Drive(scene()).advance(-1)
    assert len(Drive(scene()).advance(0)) == 0


@pytest.mark.parametrize("number", [1.0, 2.0, True, np.float64(1.0), np.True_, "1", None])
def test_advance_takes_whole_numbers_only(scene: Any, number: Any) -> None:
    """One of them is not taken for the 1 that live drives ask for, which goes a short way."""
    drive = Drive(scene())
    with pytest.raises(TypeError, match="steps = .*: .*whole number, at least 0"):
        drive.advance(number)
    with pytest.raises(TypeError, match="every = .*: .*whole number, at least 1"):
        drive.advance(1, number)
    assert drive.steps == 0


@pytest.mark.parametrize("one", [1, np.int64(1), np.uint8(1)])
def test_advance_takes_whole_numbers_of_any_kind(scene: Any, one: Any) -> None:
    taken = [Drive(scene()).advance(*given) for given in ((1,), (one,), (one, one), (1, one))]
    assert len({run.samples.tobytes() for run in taken}) == 1


def test_no_ledger_no_energy(scene: Any) -> None:
    with pytest.raises(ValueError, match="energy_balance=True"):
        Drive(scene()).energy()


def test_ledger_needs_the_acceleration_terms(scene: Any) -> None:
    with pytest.raises(SceneError, match="the effect spindle_acceleration"):
        Drive(scene(effects={"spindle_acceleration": None}), energy_balance=True)


def test_snapshot_of_another_step_is_refused(scene: Any) -> None:
    with pytest.raises(ValueError, match="other balls, step"):
        Drive(scene()).restore(Drive(scene(solver={"step": 5e-4})).snapshot())


def test_ledger_does_not_change_the_motion(scene: Any) -> None:
    one, other = Drive(scene()).advance(2000), Drive(scene(), energy_balance=True).advance(2000)
    np.testing.assert_allclose(one.samples, other.samples, rtol=1e-12, atol=1e-15)


def test_description_gives_the_scene_back() -> None:
    scene = load_scene("five-balls-8000-rpm")
    described = describe(scene)
    assert check_scene(described["scene"], "description") == scene
    assert described["effects"] == list(scene.effects)


@pytest.mark.parametrize("balls", [0, 1, 64])
def test_any_number_of_balls(scene: Any, balls: int) -> None:
    angles = np.linspace(0, 6, balls).tolist()
    drive = Drive(scene(balls={"count": balls}, start={"ball_angles": angles}))
    run = drive.advance(100)
    assert run.ball_angles.shape == (100, balls)
    assert np.all(np.isfinite(run.samples))


def test_no_steps_change_nothing() -> None:
    """Nor do they where two commands at one instant ask friction for two things."""
    one, other = (Drive(load_scene("packed-balls"), commanded=True) for _ in range(2))
    for drive in (one, other):
        drive.command(30.0)
        drive.advance(700)
        drive.command(10.0)
    assert len(one.advance(0)) == 0
    for drive in (one, other):
        drive.command(50.0)
    assert one.advance(300).samples.tobytes() == other.advance(300).samples.tobytes()


def test_the_deck_on_the_rotors_axes_is_computed_as_written(scene: Any) -> None:
    """Not by BLAS, whose kernels round differently from one processor to the next."""
    drive = Drive(scene(start={"speed": 90.0}))
    for _ in range(200):
        drive.advance(1)
        seen = drive.observe()
        c, s = math.cos(seen.psi), math.sin(seen.psi)
        for turned, (x, y) in ((seen.u, seen.position), (seen.v, seen.velocity)):
            assert turned.tolist() == [c * x + s * y, c * y - s * x]

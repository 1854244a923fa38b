"""Profiles as lists of segments: closed forms, continuity, and what is refused."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.drive.description import explain
from ab_sim.model.spindle import SpeedSchedule, top_speed_of
from ab_sim.model.spindle.segments_execution import SegmentsExecution
from ab_sim.scene import check_scene
from ab_sim.scene.load import RequestedProfile, load_profile
from ab_sim.scene.profiles import AnyProfile

QUIET = {"vibration_rms_below": 0.5, "over": 0.1, "at_most": 4.0}


def profile_of(*segments: dict[str, Any], first: float = 0.0) -> SpeedSchedule:
    return SpeedSchedule.of_profile(asked(*segments), first)


def asked(*segments: dict[str, Any]) -> AnyProfile:
    return load_profile(str({"kind": "segments", "segments": list(segments)})).profile


def test_closed_forms_up_and_down_through_zero() -> None:
    profile = profile_of(
        {"to": 100, "acceleration": 40},
        {"hold": 0.5},
        {"duration": 2, "acceleration": -20},
        {"to": -30, "acceleration": 10},
        {"hold": 1},
        {"to": 0, "acceleration": 60},
    )
    assert profile.breakpoints == (2.5, 3.0, 5.0, 14.0, 15.0, 15.5)
    times = (0, 1.25, 2.5, 2.75, 3, 4, 5, 11, 14, 14.5, 15.25, 15.5, 99)
    speeds = [0, 50, 100, 100, 100, 80, 60, 0, -30, -30, -15, 0, 0]
    assert [profile.speed(t) for t in times] == speeds
    angles = [125.0, 175.0, 335.0, 470.0, 440.0, 432.5]
    assert [profile.angle(t) for t in profile.breakpoints] == angles
    assert profile.angle(11.0) == 335.0 + 60.0 * 6.0 / 2, "as far as it goes forwards"
    assert profile.angle(99.0) == 432.5
    assert profile.steepest == 60.0 and profile.top_speed == 100.0


def test_a_start_up_with_a_hold_is_a_list_of_segments() -> None:
    """The thesis' start-up, said in both ways, is the same to the bit."""
    one = SpeedSchedule.start_up(0.0, 40.0, 200.0, period=(100.0, 0.5, 0.0))
    other = profile_of(
        {"to": 100, "acceleration": 40}, {"hold": 0.5}, {"to": 200, "acceleration": 40}
    )
    assert one.segments == other.segments


SPEEDS, SHORT = st.floats(-400, 400), st.floats(1e-6, 10)
SEGMENTS = st.one_of(
    st.builds(lambda to, a: {"to": to, "acceleration": a}, SPEEDS, st.floats(1e-3, 1e4)),
    st.builds(lambda t: {"hold": t}, SHORT),
    st.builds(lambda t, a: {"duration": t, "acceleration": a}, SHORT, st.floats(-50, 50)),
)


@given(SPEEDS, st.lists(SEGMENTS, min_size=1, max_size=12))
def test_speed_and_angle_are_continuous_and_breakpoints_are_where_they_belong(
    first: float, segments: list[dict[str, Any]]
) -> None:
    profile = profile_of(*segments, first=first)
    assert len(profile.segments) == len(segments) + 1
    # Times are rounded, and late ones more.
    blurred = 1e-9 + 8.0 * math.ulp(profile.end) * profile.steepest
    due, speed, angle = 0.0, first, 0.0
    for segment, scheduled in zip(segments, profile.segments, strict=False):
        # By itself: how long each lasts, and what has been turned by its mean speed.
        if "to" in segment:
            end = segment["to"]
            lasts = abs(end - speed) / segment["acceleration"]
        else:
            lasts = segment.get("hold") or segment["duration"]
            end = speed + segment.get("acceleration", 0.0) * lasts
        assert scheduled.start == pytest.approx(due, rel=1e-12, abs=1e-12)
        assert scheduled.law.speed(0.0) == pytest.approx(speed, rel=1e-12, abs=1e-9)
        assert scheduled.law.speed(scheduled.end - scheduled.start) == pytest.approx(
            end, abs=blurred
        )
        assert scheduled.start_angle == pytest.approx(angle, rel=1e-9, abs=1e-6)
        due, angle, speed = due + lasts, angle + 0.5 * (speed + end) * lasts, end
    assert profile.end == pytest.approx(due, rel=1e-12, abs=1e-12)
    assert profile.speed(profile.end + 1.0) == pytest.approx(speed, abs=1e-9)
    for t in profile.breakpoints:
        assert profile.speed(math.nextafter(t, -1.0)) == pytest.approx(
            profile.speed(t), abs=blurred
        )


def execution_of(profile: AnyProfile, first: float) -> SegmentsExecution:
    """Begun at 0 s, with commands that do not lead."""
    return SegmentsExecution(RequestedProfile(profile, first), ahead=0.0, silence=10.0)


def test_a_profile_goes_on_from_where_a_condition_was_met() -> None:
    execution = execution_of(
        asked(
            {"to": 100, "acceleration": 50},
            {"until": QUIET, "acceleration": 5},
            {"to": 200, "acceleration": 50},
        ),
        0.0,
    )
    assert execution.command(1.0) == 50.0
    assert execution.words == "segment 1 of 3, from 0 to 100 rad/s at 50 rad/s^2"
    execution.command(2.0)
    assert execution.words == (
        "segment 2 of 3, accelerate at 5 rad/s^2 until vibration below 0.5 m/s^2, at most 4 s"
    )
    for k in range(100):
        execution.receive(2.0 + 0.01 * k, "", 10**7 * k, (0.0, 0.0, 9.81))
    assert execution.command(3.0) == 105.0
    assert execution.words == "segment 3 of 3, from 105 to 200 rad/s at 50 rad/s^2"
    assert execution.command(3.5) == 130.0
    end = 3.0 + 95 / 50
    assert execution.command(end - 0.01) == pytest.approx(199.5) and not execution.ended
    assert execution.command(end) == 200.0 and execution.ended


def test_an_execution_says_what_is_held_and_along_what_speed_changes() -> None:
    held = execution_of(
        asked({"hold": 2.5}, {"until": QUIET}, {"to": -70, "acceleration": 7}), 70.0
    )
    held.command(0.0)
    assert held.words == "segment 1 of 3, hold 70 rad/s for 2.5 s"
    held.command(2.5)
    assert held.words == (
        "segment 2 of 3, hold 70 rad/s until vibration below 0.5 m/s^2, at most 4 s"
    )
    held.command(6.5)
    assert held.words == (
        "segment 3 of 3, from 70 to -70 rad/s at -7 rad/s^2; "
        "segment 2: no vibration below 0.5 m/s^2 within 4 s"
    )
    change = load_profile("{kind: speed_change, to_speed: 90, start_time: 1, duration: 2}").profile
    execution = execution_of(change, 70.0)
    execution.command(0.0)
    assert (
        execution.segment == (1, 2) and execution.words == "segment 1 of 2, hold 70 rad/s for 1 s"
    )
    execution.command(1.0)
    assert execution.words == ("segment 2 of 2, from 70 to 90 rad/s along a raised cosine in 2 s")


def scene_with(scene: Any, *segments: dict[str, Any]) -> Any:
    return scene(profile={"kind": "segments", "segments": list(segments)})


def test_a_drive_follows_segments_exactly(scene: Any) -> None:
    """Steps restart at each breakpoint, wherever between two steps it is."""
    made = scene_with(
        scene,
        {"to": 30.0, "acceleration": 77.0},
        {"duration": 0.1234567, "acceleration": -55.0},
        {"to": -20.0, "acceleration": 99.0},
    )
    assert check_scene(made.as_mapping(), "again") == made
    drive, profile = Drive(made), SpeedSchedule.of_scene(made)
    path = drive.advance(1200)
    for t, speed, angle in zip(path["time"], path["speed"], path["angle"], strict=True):
        assert speed == pytest.approx(profile.speed(t), abs=1e-11)
        assert angle == pytest.approx(profile.angle(t), abs=1e-10)
    assert path["speed"][-1] == -20.0


def test_conditions_have_no_speed_over_time_beforehand(scene: Any) -> None:
    made = scene_with(scene, {"to": 100.0, "acceleration": 50.0}, {"until": QUIET})
    with pytest.raises(SceneError, match=r"profile\.segments\.1\.until: .* in advance"):
        SpeedSchedule.of_scene(made)
    assert top_speed_of(made) == explain(made)["top_speed"] == 100.0
    lasting = SpeedSchedule.of_profile(made.profile.lasting, 0.0)
    assert lasting.segments == SpeedSchedule.of_profile(made.profile, 0.0).segments


@pytest.mark.parametrize(
    ("segment", "words"),
    [
        ("{}", "0 = {}: give exactly one"),
        ("{to: 1, hold: 1}", "give exactly one of"),
        ("{to: 1}", "acceleration: is missing; to"),
        ("{duration: 1}", "acceleration: is missing; duration"),
        ("{to: 1, acceleration: 0}", "acceleration = 0 rad/s^2: "),
        ("{to: 1, acceleration: -3}", "the direction follows from `to`"),
        ("{to: .nan, acceleration: 3}", "0.to = nan: "),
        ("{to: 3, acceleration: .inf}", "0.acceleration = inf: "),
        ("{hold: -1}", "0.hold = -1: "),
        ("{hold: 1, acceleration: 2}", "hold keeps the speed"),
        ("{too: 1}", "did you mean 'to'?; allowed here: to, hold, duration, until, acceleration"),
        ("{until: {vibration_rms_below: 1, over: 1}}", "until.at_most: is missing; add it"),
        ("{until: {over: 1, at_most: 2}}", "exactly one of vibration_rms_below and"),
        ("{until: {vibration_rms_below: 1, over: 3, at_most: 2}}", "more than over = 3 s"),
        ("{until: {vibration_rms_below: 0, over: 1, at_most: 2}}", "must be more than 0"),
    ],
)
def test_segments_that_make_no_sense(segment: str, words: str) -> None:
    with pytest.raises(SceneError) as refused:
        load_profile(f"{{kind: segments, segments: [{segment}]}}")
    assert words in str(refused.value)
    assert "needs at least one entry" not in str(refused.value), "one finding, not two"


def test_no_segments() -> None:
    with pytest.raises(SceneError, match="profile.segments = .*: .*one entry"):
        load_profile("{kind: segments, segments: []}")


@pytest.mark.parametrize(
    ("segments", "words"),
    [
        ([{"to": 501.0, "acceleration": 5.0}], "segments.0.to = 501 rad/s: is beyond spindle.max"),
        ([{"to": -501.0, "acceleration": 5.0}], "segments.0.to = -501 rad/s: is beyond spindle"),
        ([{"to": 1.0, "acceleration": 101.0}], "segments.0.acceleration = 101 rad/s^2: is more"),
        (
            [{"to": 400.0, "acceleration": 50.0}, {"duration": 2.0, "acceleration": 51.0}],
            "profile.segments.1: ends at 502 rad/s, which is beyond spindle.max_speed = 500",
        ),
        (
            # However early or late the condition is met.
            [
                {"until": QUIET, "acceleration": 50.0},
                {"duration": 5.5, "acceleration": -100.0},
                {"to": 0.0, "acceleration": 1.0},
            ],
            "profile.segments.1: ends at -550 rad/s",
        ),
    ],
)
def test_what_the_spindle_cannot_do(scene: Any, segments: list[Any], words: str) -> None:
    with pytest.raises(SceneError) as refused:
        scene_with(scene, *segments)
    assert words in str(refused.value)


def test_a_profile_by_itself(tmp_path: Any) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("kind: start_up\nacceleration: 40\ntarget_speed: 200\n")
    alone = load_profile(str(file), ["profile.target_speed=150"])
    assert alone.first == 0.0 and alone.profile.target_speed == 150.0
    of_scene = load_profile("thesis-hold", ["start.speed=10"])
    assert of_scene.first == 10.0 and of_scene.profile.target_speed == 200.0
    for source, changes, words in (
        (str(file), ["balls.mass=1"], "for balls; .* profile."),
        (str(file), ["profile.target_sped=1"], "did you mean 'target_speed'"),
        ("{kind: seg}", [], "kind = 'seg': .* start_up, speed_change, segments"),
        ("{kind", [], "is not valid YAML"),
        ("thesis-hold", ["profile="], "no profile to run"),
        ("thesis-hlod", [], "did you mean 'thesis-hold'"),
    ):  # fmt: skip
        with pytest.raises(SceneError, match=words.replace("?", r"\?")):
            load_profile(source, changes)

"""What the profile controller decides, without ROS: conditions, aborts, and commands that flow."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ab_sim.model.spindle.profile_run import ProfileRun, ProfileState
from ab_sim.model.spindle.segments_execution import SegmentsExecution
from ab_sim.nodes.timed_run import CheckedProfile
from ab_sim.scene.load import load_profile

AHEAD = 0.005
QUIET = {"vibration_rms_below": 0.5, "over": 0.2, "at_most": 5.0}
HELD = ({"to": 100, "acceleration": 100}, {"until": QUIET}, {"to": 200, "acceleration": 50})


def planned(*segments: dict[str, Any]) -> CheckedProfile:
    text = str({"kind": "segments", "segments": list(segments)})
    return CheckedProfile(load_profile(text), text, [], AHEAD)


class Bench:
    """A run, a clock, and a disc that shakes."""

    def __init__(self, *segments: dict[str, Any], deceleration: float = 100.0) -> None:
        self.plan = planned(*segments)
        self.deceleration = deceleration
        self.said: list[str] = []
        self.well: list[bool] = []
        self.run = ProfileRun(AHEAD, self.say)
        self.now = 1000.0
        self.shaking: dict[str, float] = {"": 3.0}
        self.offset = 9.81
        self.commands: list[float] = []

    def start(self) -> str:
        return self.run.start(self.now, self.plan.execution(1.0), self.deceleration)

    @property
    def execution(self) -> SegmentsExecution:
        assert isinstance(self.run.execution, SegmentsExecution)
        return self.run.execution

    def say(self, status: str, well: bool) -> None:
        self.said.append(status)
        self.well.append(well)

    def go(self, seconds: float, dt: float = 0.005) -> None:
        """On, with a sample of each sensor at every tick: it turns at 30 Hz."""
        for _ in range(round(seconds / dt)):
            self.now += dt
            stamp = round((self.now - 990.0) * 1e9)  # the drive's clock is another one
            turn = 2 * math.pi * 30.0 * self.now
            for sensor, large in self.shaking.items():
                vector = large * math.cos(turn), large * math.sin(turn), self.offset
                if self.run.execution is not None:
                    self.execution.receive(self.now, sensor, stamp, vector)
            if (command := self.run.tick(self.now)) is not None:
                self.commands.append(command)

    @property
    def state(self) -> str:
        return self.run.status.partition(":")[0]


def started(*segments: dict[str, Any], **more: float) -> Bench:
    session = Bench(*segments, **more)
    assert session.start() == ""
    return session


def test_the_condition_ends_the_segment() -> None:
    session = started(*HELD)
    session.go(3.0)
    assert session.run.status == (
        "running: segment 2 of 3, hold 100 rad/s until vibration below 0.5 m/s^2, at most 5 s"
    )
    assert session.execution.vibration == pytest.approx(3.0, rel=0.02), "whatever gravity is"
    assert session.commands[-1] == 100.0
    session.shaking[""] = 0.4
    session.go(0.45)  # two windows at most
    assert session.run.status == "running: segment 3 of 3, from 100 to 200 rad/s at 50 rad/s^2"
    session.go(2.1)
    assert session.state == "done" and session.commands[-1] == 200.0 and session.run.why == ""
    assert [word.partition(":")[0] for word in session.said] == [
        "idle", "running", "running", "running", "done",
    ]  # fmt: skip


def test_the_loudest_sensor_counts_and_its_word_is_awaited() -> None:
    session = started(*HELD)
    session.shaking = {"near": 0.1, "far": 3.0}
    session.go(2.0)
    assert "segment 2" in session.run.status and session.execution.vibration == pytest.approx(
        3.0, rel=0.02
    )
    session.shaking["far"] = 0.1
    session.go(0.45)
    assert "segment 3" in session.run.status


def test_more_than_a_limit() -> None:
    above = {"vibration_rms_above": 2.0, "over": 0.1, "at_most": 9.0}
    session = started({"until": above, "acceleration": 10.0}, {"to": 0, "acceleration": 50})
    session.shaking[""] = 1.0
    session.go(3.0)
    assert session.commands[-1] == pytest.approx(30.05)
    session.shaking[""] = 2.5
    session.go(0.25)
    assert "segment 2 of 2, from 3" in session.run.status
    session.go(1.0)
    assert session.state == "done" and session.commands[-1] == 0.0
    assert session.start() == "", "it is back where it begins"


def test_a_condition_that_is_not_met_in_time() -> None:
    session = started(*HELD)
    session.go(1.0 + 5.0 + 2.1)
    assert session.state == "done"
    unmet = "segment 2: no vibration below 0.5 m/s^2 within 5 s"
    assert session.run.why == unmet and session.well == [True] * 3 + [False] * 2
    assert (
        session.said[-2] == f"running: segment 3 of 3, from 100 to 200 rad/s at 50 rad/s^2; {unmet}"
    )
    session = started(*HELD[:2])
    session.go(1.0 + 5.0 + 0.1)
    assert session.run.status == f"done: {unmet}"
    session = started(HELD[0], {"until": {**QUIET, "otherwise": "abort"}}, HELD[2])
    session.go(1.0 + 5.0 + 0.1)
    assert session.state == "aborting"
    session.go(1.0)
    assert session.state == "aborted" and session.commands[-1] == 0.0
    assert session.run.why == unmet


def test_a_late_tick_passes_no_condition_by() -> None:
    session = started(HELD[0], {"until": {**QUIET, "otherwise": "abort"}}, HELD[2])
    session.go(0.9)
    session.now += 20.0
    assert session.run.tick(session.now) is not None
    assert session.state == "aborting"


@pytest.mark.parametrize("bad", ["silent", "nan", "stamp", "one of two"])
def test_vibration_that_does_not_come(bad: str) -> None:
    session = started(*HELD)
    session.shaking["other"] = 3.0
    session.go(2.0)
    if bad == "one of two":
        del session.shaking["other"]
    elif bad == "nan":
        session.offset = math.nan
    else:
        session.shaking.clear()
    for _ in range(90):
        session.go(0.01)
        if bad == "stamp":
            for sensor in ("", "other"):
                session.execution.receive(session.now, sensor, 12_000_000_000, (0.0, 0.0, 0.0))
    assert session.state == "running", "not yet"
    if bad == "stamp":  # which once went back to that, and then stood still
        session.go(0.9)
    session.go(0.2)
    assert session.state == "aborting"
    assert (
        "segment 2 waits for the vibration, and no valid sample of it has come" in session.run.why
    )
    session.go(1.1)
    assert session.state == "aborted" and session.commands[-1] == 0.0


def test_silence_does_not_matter_where_nothing_waits_for_it() -> None:
    session = started({"to": 100, "acceleration": 50}, {"hold": 3.0})
    session.shaking.clear()
    assert not session.plan.inputs.vibration
    session.go(5.1)
    assert session.state == "done"


def test_an_abort_ramps_down() -> None:
    session = started(*HELD, deceleration=20.0)
    session.go(2.0)
    assert session.run.abort(session.now, "by ~/abort") == ""
    assert session.run.status == "aborting: by ~/abort"
    assert session.run.abort(session.now, "again") == "" and session.run.why == "by ~/abort"
    assert session.start() == "ramping down; wait for standstill"
    session.go(2.5)
    assert session.commands[-1] == pytest.approx(50.0, abs=0.2)
    session.go(2.5)
    assert session.state == "aborted" and session.commands[-1] == 0.0
    assert session.run.abort(session.now, "") == "not running"
    assert session.start() == "" and session.run.why == ""


def test_what_is_refused() -> None:
    session = Bench(*HELD)
    assert session.run.abort(session.now, "") == "not running"
    assert session.run.tick(session.now) is None, "nothing is commanded before the start"
    session.run.wait("for somebody")
    assert session.run.status == "waiting: for somebody"
    assert session.run.abort(session.now, "") == "" and session.state == "idle"
    assert session.start() == ""
    assert session.start() == "running already; abort first"
    session.go(9.0)
    assert session.state == "done"
    assert session.start().startswith("200 rad/s is commanded, and the profile begins at")
    session.run.drop("the drive was reset")
    assert session.run.tick(session.now) == 0.0 and session.state == "aborted"


SEGMENT = st.sampled_from(
    [
        {"to": 60, "acceleration": 80},
        {"to": -40, "acceleration": 30},
        {"to": 0, "acceleration": 50},
        {"hold": 0.3},
        {"duration": 0.4, "acceleration": -70},
        {"until": {**QUIET, "at_most": 1.0}, "acceleration": 25},
        {"until": {**QUIET, "at_most": 0.5, "otherwise": "abort"}},
        {"until": {"vibration_rms_above": 1.0, "over": 0.05, "at_most": 1.5}},
    ]
)
EVENT = st.one_of(
    st.tuples(st.just("go"), st.floats(0.005, 1.0)),
    st.tuples(st.just("shake"), st.sampled_from([0.0, 0.2, 5.0, math.nan, 1e300])),
    st.tuples(st.just("start"), st.just(0.0)),
    st.tuples(st.just("abort"), st.just(0.0)),
)


@given(st.lists(SEGMENT, min_size=1, max_size=5), st.lists(EVENT, max_size=8))
def test_whatever_happens_commands_flow(segments: list[Any], events: list[Any]) -> None:
    """No command is farther from the one before than the steepest ramp takes it in the time."""
    session = started(*segments, deceleration=80.0)
    for event, value in events:
        if event == "go":
            session.go(value)
        elif event == "shake":
            session.shaking[""] = value
        elif event == "start":
            session.start()
        else:
            session.run.abort(session.now, "by hand")
        assert ProfileState(session.state) is session.run.state
    session.run.abort(session.now, "at last")
    session.go(3.0)
    flow = [0.0, *session.commands]
    assert all(map(math.isfinite, flow))
    assert max(abs(b - a) for a, b in zip(flow, flow[1:], strict=False)) <= 80.0 * 2 * 0.005 + 1e-9
    assert session.state in ("aborted", "done") and flow[-1] == 0.0


def test_another_profile_waits_for_the_next_start() -> None:
    session = started({"to": 100, "acceleration": 100}, deceleration=50.0)
    session.plan, session.deceleration = planned({"to": 8, "acceleration": 80}), 80.0
    session.go(2.0)
    assert session.state == "done" and session.commands[-1] == 100.0
    session.run.abort(session.now, "by hand")
    session.go(1.0)
    assert session.commands[-1] == pytest.approx(50.0, abs=0.5), "as steeply as it was to be"
    session.go(2.0)
    assert session.start() == ""
    session.go(1.0)
    assert session.state == "done" and session.commands[-1] == 8.0

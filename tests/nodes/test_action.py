"""The action ~/run: a profile to its end, canceled, refused, and whatever becomes of who asked."""

import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from ab_msgs_py import JointSample, topics
from ab_msgs_py.actions import RunRequest, goal_of, run_profile
from ab_msgs_py.samples import text_of
from tests.domains import own_domain
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros
pytest.importorskip("ab_interfaces", reason="the action is not built: make action")

ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)
"""Of action_msgs/msg/GoalStatus."""
SLOW = "{kind: segments, segments: [{to: 400, acceleration: 4}]}"
"""25 s of this drive: more than a few requests take, however busy the machine."""
QUICK = "{kind: segments, segments: [{to: 20, acceleration: 40}, {to: 0, acceleration: 40}]}"
ASKER = """
import sys
import rclpy
from rclpy.action import ActionClient
from ab_msgs_py.actions import RunRequest, goal_of, run_profile

rclpy.init()
node = rclpy.create_node("asker")
client = ActionClient(node, run_profile(), "profile_controller/run")
assert client.wait_for_server(60.0)
sent = client.send_goal_async(goal_of(RunRequest(sys.argv[1], [])))
rclpy.spin_until_future_complete(node, sent)
print("accepted" if sent.result().accepted else "rejected", flush=True)
rclpy.spin(node)
"""


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator["Session"]:
    """A drive that is four times as fast as real time, and a controller."""
    with own_domain() as domain:
        fleet = Fleet(domain, tmp_path_factory.mktemp("action"))
        fleet.start("drive_sim", scene="thesis-hold", speed_factor=4.0)
        fleet.start(
            "profile_controller", profile=f'"{QUICK}"', use_sim_time=True, abort_deceleration=45.0
        )
        yield Session(fleet)
        fleet.close()


class Session:
    """Who asks."""

    def __init__(self, fleet: Fleet) -> None:
        from action_msgs.msg import GoalStatusArray
        from rclpy.action import ActionClient
        from rclpy.qos import DurabilityPolicy, QoSProfile

        self.fleet = fleet
        self.status = fleet.listen(topics.PROFILE_STATUS)
        self.joints = fleet.listen(topics.JOINT_STATES)
        self.feedback: list[Any] = []
        """Feedback on the goal that was asked for last."""
        self.goals: list[dict[bytes, int]] = []
        """What ROS's tools show: states of all goals, told anew at each change."""
        fleet.node.create_subscription(
            GoalStatusArray,
            "profile_controller/run/_action/status",
            lambda message: self.goals.append(
                {bytes(each.goal_info.goal_id.uuid): each.status for each in message.status_list}
            ),
            # ROS's own depth of 1 would pass over one of two that come before this looks.
            QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL),
        )
        self.client: Any = ActionClient(fleet.node, run_profile(), "profile_controller/run")
        fleet.until(self.client.server_is_ready, "there is the action")
        fleet.acquainted()
        fleet.until(lambda: self.joints, "the drive runs")

    def ask(self, profile: str = "", *changes: str) -> Any:
        """Of an accepted goal the handle."""
        feedback: list[Any] = []
        self.feedback = feedback  # that of the goal before may still arrive
        sent = self.client.send_goal_async(
            goal_of(RunRequest(profile, [*changes])),
            feedback_callback=lambda message: feedback.append(message.feedback),
        )
        self.fleet.until(sent.done, "the goal is answered")
        assert sent.result().accepted
        return sent.result()

    def result(self, goal: Any) -> tuple[int, Any]:
        """How it ended."""
        ended = goal.get_result_async()
        self.fleet.until(ended.done, "the result")
        return ended.result().status, ended.result().result

    def states_of(self, goal: Any) -> list[int]:
        """What is told of a goal so far, each state once."""
        which = bytes(goal.goal_id.uuid)
        return list(dict.fromkeys(each[which] for each in self.goals if which in each))

    def until(self, condition: Callable[[], Any], what: str) -> None:
        self.fleet.until(condition, what)

    @property
    def speed(self) -> float:
        return JointSample.of(self.joints[-1]).spindle_speed


def test_a_goal_is_run_to_its_end(session: Session) -> None:
    # Slowly: how late the machine is at the profile's end counts as so much less of its time.
    assert session.fleet.set("drive_sim", speed_factor=0.25)[0]
    status, result = session.result(session.ask())
    assert status == SUCCEEDED and (result.message, result.speed) == ("done", 0.0)
    assert result.elapsed == pytest.approx(1.0, abs=0.1), "as long as the profile lasts"
    told = session.feedback
    assert {(each.segment, each.segments) for each in told} == {(1, 2), (2, 2)}
    assert told[0].status == "running: segment 1 of 2, from 0 to 20 rad/s at 40 rad/s^2"
    assert any(each.speed > 0.0 for each in told) and told[-1].elapsed <= result.elapsed
    assert all(each.critical_speed != each.critical_speed for each in told), "nothing is believed"
    assert session.fleet.set("drive_sim", speed_factor=4.0)[0]
    status, result = session.result(session.ask())
    assert status == SUCCEEDED, "and once more"


def test_ros_tools_see_how_far_a_goal_is(session: Session) -> None:
    """While its profile runs it is being executed, and not only accepted."""
    goal = session.ask(SLOW)
    session.until(lambda: EXECUTING in session.states_of(goal), "it is executed")
    session.until(lambda: goal.status == EXECUTING, "and its client knows")
    session.until(lambda: session.speed > 10.0, "there is something to ramp down")
    canceled = goal.cancel_goal_async()
    session.until(canceled.done, "the request is answered")
    assert session.result(goal)[0] == CANCELED
    session.until(lambda: CANCELED in session.states_of(goal), "its last state")
    told = [state for state in session.states_of(goal) if state != ACCEPTED]
    assert told == [EXECUTING, CANCELING, CANCELED]


def test_what_is_refused_says_why(session: Session) -> None:
    """By a result: ROS's refusal has no text."""
    for asked, words in (
        (("no-such-scene",), "no-such-scene"),
        (("", "profile.target_speed=1"), "the goal names none"),
        (("thesis-hold", "profile.target_sped=1"), "did you mean 'target_speed'?"),
    ):
        status, result = session.result(session.ask(*asked))
        assert status == ABORTED and words in result.message, result.message
    first = session.ask(SLOW)
    status, result = session.result(session.ask())
    assert status == ABORTED and result.message == (
        "refused: another goal is being run; cancel it first"
    )
    assert session.fleet.call("profile_controller/start") == (
        False,
        "running already; abort first",
    )
    assert session.fleet.call("profile_controller/abort")[0]
    status, result = session.result(first)
    assert status == ABORTED and result.message == "aborted: by ~/abort" and result.speed == 0.0


def test_a_canceled_goal_ramps_down_first(session: Session) -> None:
    goal = session.ask(SLOW)
    session.until(lambda: session.speed > 10.0, "10 rad/s")
    canceled = goal.cancel_goal_async()
    session.until(canceled.done, "the request is answered")
    assert len(canceled.result().goals_canceling) == 1
    status, result = session.result(goal)
    assert status == CANCELED and result.speed == 0.0
    assert result.message == "aborted: canceled by the client of ~/run"
    assert {"running", "aborting"} <= {each.status.partition(":")[0] for each in session.feedback}
    session.until(lambda: session.speed == 0.0, "it stands still")


def test_a_goal_outlives_who_asked(session: Session) -> None:
    fleet = session.fleet
    asker = fleet.start_process("asker", sys.executable, "-c", ASKER, QUICK.replace("20", "60"))
    fleet.until(lambda: "accepted" in fleet.log("asker"), "the goal is accepted")
    del fleet.processes["asker"]
    asker.kill()
    asker.wait()
    session.until(
        lambda: session.status and text_of(session.status[-1]) == "done", "it is run to its end"
    )
    assert session.result(session.ask())[0] == SUCCEEDED, "and so is the next one"


def test_a_drive_that_is_reset_ends_the_goal(session: Session) -> None:
    goal = session.ask(SLOW)
    session.until(lambda: session.speed > 10.0, "10 rad/s")
    assert session.fleet.call("drive_sim/reset")[0]
    status, result = session.result(goal)
    assert status == ABORTED and result.message.startswith("aborted: time jumped from "), result


def test_a_controller_that_ends_says_so(session: Session) -> None:
    goal = session.ask(SLOW)
    ended = goal.get_result_async()
    session.until(lambda: session.speed > 5.0, "5 rad/s")
    assert session.fleet.stop("profile_controller") == 0
    session.until(ended.done, "the result")
    assert ended.result().status == ABORTED
    message = ended.result().result.message
    assert message.startswith("the profile controller has ended; running: segment 1 of 1"), message
    assert "Traceback" not in session.fleet.log("profile_controller")

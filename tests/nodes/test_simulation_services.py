"""ROS's simulation_interfaces, as a standard client sees them on a drive."""

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from ab_msgs_py import topics
from ab_sim import scene_names
from ab_sim.base.yaml_files import find_scene
from tests.domains import own_domain
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros
pytest.importorskip("simulation_interfaces.srv", reason="not built: make action")
from simulation_interfaces import msg, srv  # noqa: E402
from simulation_interfaces.action import SimulateSteps  # noqa: E402

Result, States = msg.Result, msg.SimulationState
OK, FAILED = Result.RESULT_OK, Result.RESULT_OPERATION_FAILED
PAGE = Path(__file__).parents[2] / "docs/howto/simulation-interfaces.md"
CALLS = re.findall(
    r'^ros2 service call (\S+) simulation_interfaces/srv/(\w+) "(.*)"$', PAGE.read_text(), re.M
)
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


class Drive:
    """A drive whose folder of worlds has a scene, a file that is none, and one beside it."""

    def __init__(self, domain: int, folder: Path) -> None:
        from rclpy.action import ActionClient

        self.fleet = Fleet(domain, folder)
        worlds = folder / "worlds"
        worlds.mkdir()
        self.outside = folder / "outside.yaml"
        text = find_scene("no-ball").read_text()
        for file in (worlds / "mine.yaml", self.outside):
            file.write_text(f"description: Mine.\n{text[text.index('source:') :]}")
        (worlds / "broken.yaml").write_text("rotor: 5\n")
        self.fleet.start("drive_sim", scene="thesis-hold", worlds=worlds, start_paused=True)
        self.action: Any = ActionClient(self.fleet.node, SimulateSteps, "drive_sim/simulate_steps")
        self.clock = self.fleet.listen(topics.CLOCK)
        self._feedback: list[Any] = []
        """The client's own is not enough: it drops what comes after the result."""
        self.fleet.node.create_subscription(
            SimulateSteps.Impl.FeedbackMessage,
            "drive_sim/simulate_steps/_action/feedback",
            self._feedback.append,
            20,
        )

    def ask(self, kind: Any, **fields: Any) -> Any:
        """Call a service by the standard's name for its type; return its response."""
        name = re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()
        return self.fleet.ask(kind, f"drive_sim/{name}", filled(kind.Request(), fields))

    def code(self, kind: Any, **fields: Any) -> int:
        return int(self.ask(kind, **fields).result.result)

    def refused(self, kind: Any, **fields: Any) -> tuple[int, str]:
        result = self.ask(kind, **fields).result
        return result.result, result.error_message

    @property
    def state(self) -> int:
        return int(self.ask(srv.GetSimulationState).state.state)

    def go(self, state: int) -> None:
        """Bring it into a state; it may be in it."""
        assert self.code(srv.SetSimulationState, state={"state": state}) in (OK, 101)

    def entity(self, name: str) -> Any:
        answer = self.ask(srv.GetEntityState, entity=name)
        assert answer.result.result == OK
        return answer.state

    @property
    def time_ms(self) -> int:
        stamp = self.entity("deck").header.stamp
        return round(stamp.sec * 1e3 + stamp.nanosec * 1e-6)

    def simulate(
        self, steps: int, then: Callable[[Any], Any] = lambda goal: None
    ) -> tuple[int, Any, list[int]]:
        """Run a goal; return its state, its result, and the completed steps of its feedback."""
        self._feedback.clear()
        sent = self.action.send_goal_async(SimulateSteps.Goal(steps=steps))
        self.fleet.until(sent.done, "the goal is answered")
        goal = sent.result()
        then(goal)
        ended = goal.get_result_async()
        self.fleet.until(ended.done, "the result")

        def completed() -> list[int]:
            mine = [told for told in self._feedback if told.goal_id == goal.goal_id]
            return [told.feedback.completed_steps for told in mine]

        if ended.result().status == SUCCEEDED:  # feedback may come after the result
            self.fleet.until(lambda: len(completed()) == steps, "the last feedback")
        return ended.result().status, ended.result().result.result, completed()


def filled(message: Any, fields: dict[str, Any]) -> Any:
    """Set nested fields, as the command line does."""
    for name, value in fields.items():
        if isinstance(value, dict):
            filled(getattr(message, name), value)
        else:
            setattr(message, name, value)
    return message


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Drive]:
    with own_domain() as domain:
        made = Drive(domain, tmp_path_factory.mktemp("simulation"))
        made.fleet.until(made.action.server_is_ready, "there is the action")
        made.fleet.acquainted()
        yield made
        made.fleet.close()


def test_it_begins_stopped_and_says_what_it_offers(drive: Drive) -> None:
    assert drive.state == States.STATE_STOPPED
    known, features = msg.SimulatorFeatures, drive.ask(srv.GetSimulatorFeatures).features
    assert known.SIMULATION_RESET_TIME in features.features
    assert known.SPAWNING not in features.features
    assert "wake-up" in features.custom_info
    offered = dict(drive.fleet.node.get_service_names_and_types())
    assert offered["/drive_sim/get_entities"] == ["simulation_interfaces/srv/GetEntities"]
    assert offered["/drive_sim/pause"] == ["std_srvs/srv/SetBool"], "those of std_srvs stay"


def test_states(drive: Drive) -> None:
    change = srv.SetSimulationState
    drive.go(States.STATE_STOPPED)
    assert drive.code(change, state={"state": 0}) == change.Response.ALREADY_IN_TARGET_STATE
    assert drive.code(change, state={"state": 2}) == OK
    assert drive.state == States.STATE_PAUSED, "at t = 0"
    assert drive.code(change, state={"state": 1}) == OK
    assert drive.state == States.STATE_PLAYING
    drive.fleet.until(lambda: drive.time_ms > 0, "time goes on")
    assert drive.fleet.call("drive_sim/pause", True)[0]
    assert drive.state == States.STATE_PAUSED, "the services of std_srvs do the same"
    assert drive.time_ms > 0
    assert drive.code(change, state={"state": 0}) == OK
    assert (drive.state, drive.time_ms) == (States.STATE_STOPPED, 0)
    code, text = drive.refused(change, state={"state": 4})
    assert code == Result.RESULT_FEATURE_UNSUPPORTED and "state = 4" in text


def test_a_drive_in_lock_step_cannot_play(drive: Drive) -> None:
    drive.go(States.STATE_STOPPED)
    assert drive.fleet.set("drive_sim", time_mode="lock_step")[0]
    code, text = drive.refused(srv.SetSimulationState, state={"state": 1})
    assert code == srv.SetSimulationState.Response.STATE_TRANSITION_ERROR and "lock_step" in text
    assert drive.code(srv.StepSimulation, steps=5) == OK
    assert drive.time_ms == 20
    assert drive.fleet.set("drive_sim", time_mode="paced")[0]


def test_steps(drive: Drive) -> None:
    drive.go(States.STATE_STOPPED)
    assert drive.code(srv.StepSimulation, steps=10) == OK
    assert (drive.state, drive.time_ms) == (States.STATE_PAUSED, 40), "ten wake-ups of 4 ms"
    assert drive.code(srv.StepSimulation) == OK
    assert drive.time_ms == 44, "one by default"
    code, text = drive.refused(srv.StepSimulation, steps=2**63)
    assert code == FAILED and "10000" in text
    drive.go(States.STATE_PLAYING)
    code, text = drive.refused(srv.StepSimulation, steps=1)
    assert code == FAILED and "pause first" in text


def test_steps_as_a_goal(drive: Drive) -> None:
    drive.go(States.STATE_STOPPED)
    drive.fleet.command(50.0)  # which a goal is not kept from taking
    status, result, completed = drive.simulate(10)
    assert (status, result.result) == (SUCCEEDED, OK)
    assert completed == list(range(1, 11)) and drive.time_ms == 40
    assert drive.entity("spindle").twist.angular.z > 0.0

    def cancel(goal: Any) -> None:
        canceled = goal.cancel_goal_async()
        drive.fleet.until(canceled.done, "the request is answered")

    status, result, completed = drive.simulate(2**60, cancel)
    assert (status, result.result) == (CANCELED, FAILED)
    assert "canceled after" in result.error_message and drive.state == States.STATE_PAUSED
    assert drive.simulate(0)[:2] == (SUCCEEDED, Result(result=OK))
    status, result, _ = drive.simulate(2**60, lambda goal: drive.go(States.STATE_PLAYING))
    assert status == ABORTED and "not paused" in result.error_message
    status, result, _ = drive.simulate(1)
    assert (status, result.result) == (ABORTED, FAILED) and "pause first" in result.error_message


def test_resets(drive: Drive) -> None:
    reset = srv.ResetSimulation

    def moving() -> bool:
        return bool(drive.entity("spindle").twist.angular.z > 0.0)

    drive.go(States.STATE_STOPPED)
    drive.fleet.command(50.0)
    for scope, time_goes, state_goes in ((1, True, False), (2, False, True), (3, True, True),
                                         (0, True, True), (255, True, True)):  # fmt: skip
        drive.fleet.command(49.0, 50.0)
        assert drive.code(srv.StepSimulation, steps=10) == OK
        assert moving() and drive.time_ms > 0
        assert drive.code(reset, scope=scope) == OK
        assert (drive.time_ms == 0, not moving()) == (time_goes, state_goes), scope
        drive.go(States.STATE_STOPPED)
    code, text = drive.refused(reset, scope=reset.Request.SCOPE_SPAWNED)
    assert code == Result.RESULT_FEATURE_UNSUPPORTED and "scope = 4" in text


def test_entities(drive: Drive) -> None:
    drive.go(States.STATE_STOPPED)
    everything = drive.ask(srv.GetEntities).entities
    assert everything == ["deck", "spindle", "ball_0", "ball_1"]
    balls = drive.ask(srv.GetEntitiesStates, filters={"filter": "ball_[0-9]+"})
    assert balls.entities == ["ball_0", "ball_1"]
    place = balls.states[0].pose.position
    assert balls.states[0].header.frame_id == "drive_housing"
    assert math.hypot(place.x, place.y) == pytest.approx(0.01), "radius of the race"
    assert math.isnan(balls.states[0].acceleration.linear.x), "unknown"
    for filters, code, words in (
        ({"filter": "("}, FAILED, "regular expression"),
        ({"filter": "a" * 41}, FAILED, "40 characters"),
        ({"filter": "(((.*)*)*)*x"}, FAILED, "repeat no group"),
        ({"tags": {"tags": ["heavy"]}}, Result.RESULT_FEATURE_UNSUPPORTED, "tags"),
    ):
        refusal = drive.refused(srv.GetEntities, filters=filters)
        assert refusal[0] == code and words in refusal[1]
    code, text = drive.refused(srv.GetEntityState, entity="ball_7")
    assert code == Result.RESULT_NOT_FOUND and "ball_1" in text


def test_entities_are_put_elsewhere(drive: Drive) -> None:
    move = srv.SetEntityState
    drive.go(States.STATE_STOPPED)
    at = {"pose": {"position": {"y": 0.01}}}
    assert drive.code(move, entity="ball_1", state=at, set_pose=True) == OK
    place = drive.entity("ball_1").pose.position
    assert (place.x, place.y) == pytest.approx((0.0, 0.01), abs=1e-12)
    velocity = {"twist": {"linear": {"x": 0.02}}}
    assert drive.code(move, entity="deck", state=velocity, set_twist=True) == OK
    assert drive.entity("deck").twist.linear.x == pytest.approx(0.02)
    assert drive.entity("ball_1").twist.linear.x == pytest.approx(0.02), "carried along"
    # As before version 2.1, which has no flags.
    assert drive.code(move, entity="deck", state={"pose": {"position": {"x": 1e-4}}}) == OK
    assert drive.entity("deck").twist.linear.x == 0.0
    assert drive.code(srv.StepSimulation, steps=10) == OK
    for entity, state, code, words in (
        ("ball_1", {"pose": {"position": {"y": 0.1}}}, move.Response.INVALID_POSE, "off its race"),
        ("deck", {"header": {"frame_id": "map"}}, Result.RESULT_FEATURE_UNSUPPORTED, "'map'"),
        ("spindle", {}, FAILED, "spindle/command"),
        ("lid", {}, Result.RESULT_NOT_FOUND, "'lid'"),
    ):
        refusal = drive.refused(move, entity=entity, state=state)
        assert refusal[0] == code and words in refusal[1]


def test_worlds(drive: Drive) -> None:
    drive.go(States.STATE_PLAYING)
    worlds = drive.ask(srv.GetAvailableWorlds).worlds
    uris = [world.world_resource.uri for world in worlds]
    assert uris == [*scene_names(), "broken.yaml", "mine.yaml"]
    assert worlds[-1].description == "Mine."
    loaded = drive.ask(srv.LoadWorld, world_resource={"uri": "mine.yaml"})
    assert (loaded.result.result, loaded.world.name) == (OK, "mine")
    assert drive.state == States.STATE_STOPPED
    assert drive.ask(srv.GetEntities).entities == ["deck", "spindle"]
    assert drive.ask(srv.GetCurrentWorld).world.description == "Mine."
    assert drive.code(srv.LoadWorld, world_resource={"uri": "thesis-hold"}) == OK
    current = drive.ask(srv.GetCurrentWorld).world
    assert current.name == current.world_resource.uri == "thesis-hold"


def test_no_other_files_are_loaded(drive: Drive) -> None:
    """A peer can name neither a path nor a folder."""
    load, answer = srv.LoadWorld, srv.LoadWorld.Response
    drive.go(States.STATE_STOPPED)
    for uri in (str(drive.outside), f"file://{drive.outside}", "../outside.yaml", "thesis-hol"):
        code, text = drive.refused(load, world_resource={"uri": uri})
        assert code == Result.RESULT_NOT_FOUND and "get_available_worlds" in text
    code, text = drive.refused(load, world_resource={"uri": "broken.yaml"})
    assert code == answer.RESOURCE_PARSE_ERROR and "rotor" in text
    assert drive.code(load) == answer.NO_RESOURCE
    code, text = drive.refused(load, world_resource={"resource_string": "rotor: 5"})
    assert code == Result.RESULT_FEATURE_UNSUPPORTED and "resource_string" in text
    code, text = drive.refused(srv.GetAvailableWorlds, additional_sources=["/etc"])
    assert code == Result.RESULT_FEATURE_UNSUPPORTED and "worlds" in text
    assert not drive.fleet.set("drive_sim", worlds="/etc")[0], "nor can it set the parameter"
    assert drive.ask(srv.GetCurrentWorld).world.name == "thesis-hold", "as before"


@pytest.mark.parametrize(("service", "kind", "request_"), CALLS)
def test_the_commands_of_the_page(drive: Drive, service: str, kind: str, request_: str) -> None:
    drive.go(States.STATE_PAUSED)
    if (asked := yaml.safe_load(request_)) == {"state": {"state": States.STATE_QUITTING}}:
        return  # below
    answer = drive.fleet.ask(
        getattr(srv, kind), service, filled(getattr(srv, kind).Request(), asked)
    )
    assert not hasattr(answer, "result") or answer.result.result in (OK, 101), answer.result


def test_worlds_of_a_life_cycle(fleet: Fleet) -> None:
    """Before a scene is loaded there is no world; to quit ends the node in order."""
    fleet.start("drive_sim", scene="thesis-hold", autostart=False)

    def state() -> int:
        answer = fleet.ask(
            srv.GetSimulationState,
            "drive_sim/get_simulation_state",
            srv.GetSimulationState.Request(),
        )
        return int(answer.state.state)

    assert state() == States.STATE_NO_WORLD
    step = fleet.ask(srv.StepSimulation, "drive_sim/step_simulation", srv.StepSimulation.Request())
    assert step.result.result == Result.RESULT_INCORRECT_STATE
    assert "configure" in step.result.error_message
    world = fleet.ask(
        srv.GetCurrentWorld, "drive_sim/get_current_world", srv.GetCurrentWorld.Request()
    )
    assert world.result.result == srv.GetCurrentWorld.Response.NO_WORLD_LOADED
    assert fleet.change("drive_sim", "configure")
    assert state() == States.STATE_STOPPED
    assert fleet.change("drive_sim", "activate")
    assert state() == States.STATE_PLAYING
    quit_ = srv.SetSimulationState.Request(state=States(state=States.STATE_QUITTING))
    answer = fleet.ask(srv.SetSimulationState, "drive_sim/set_simulation_state", quit_)
    assert answer.result.result == OK
    assert fleet.ended("drive_sim") == 0


def test_without_the_package_the_log_says_so(fleet: Fleet) -> None:
    fleet.start("drive_sim", "tests.nodes.without_simulation_interfaces", scene="thesis-hold")
    assert fleet.call("drive_sim/pause", True)[0], "all else is offered"
    assert "simulation_interfaces is not found" in fleet.log("drive_sim")
    names = [name for name, _ in fleet.node.get_service_names_and_types()]
    assert "/drive_sim/step" in names and "/drive_sim/step_simulation" not in names

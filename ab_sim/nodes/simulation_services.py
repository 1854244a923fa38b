"""ROS's standard services and action for simulators (package simulation_interfaces)."""

from __future__ import annotations

import contextlib
import importlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rclpy.action import CancelResponse
from rclpy.parameter import Parameter

from ab_msgs_py.samples import HOUSING, frame_of
from ab_msgs_py.services import Answer
from ab_sim.base.errors import AbSimError, CommandError, InputError, SceneError, nearest
from ab_sim.base.version import __version__
from ab_sim.base.yaml_files import find_scene, read_scene_file, scene_names
from ab_sim.drive.bodies import BodyPose, BodyRates, body_names, motion_of, moved
from ab_sim.nodes.base_node import Goal, GoalServer
from ab_sim.nodes.drive_control import DriveControl, sound
from ab_sim.nodes.drive_node import DriveNode
from ab_sim.nodes.parameters import path_of
from ab_sim.nodes.session import Session


class SimulateSteps:
    """Serves the action, one goal at a time.

    Each wake-up is a separate task of the node's executor. Between two tasks, the executor answers
    other requests, such as one to cancel.

    Parameters
    ----------
    node
        Node of the drive.
    kind
        Type of the action.
    codes
        Message type with the result codes of the standard.
    control
        Services of the drive, which simulate the wake-ups.
    """

    def __init__(self, node: DriveNode, kind: Any, codes: Any, control: DriveControl) -> None:
        self._node, self._kind, self._codes, self._control = node, kind, codes, control
        self._goal: Goal | None = None
        self._server = GoalServer(
            node, kind, "~/simulate_steps", self._accepted, lambda goal: CancelResponse.ACCEPT
        )

    def _accepted(self, goal: Goal) -> None:
        """Begin an accepted goal, or abort it if another goal is being executed."""
        goal.execute()
        if self._goal is not None:
            self._end(goal, "another goal is being executed; cancel it first")
            return
        self._goal = goal
        self._continue(0)

    def _continue(self, completed: int) -> None:
        """Simulate the next wake-up of the goal; ``completed``: number of those before."""
        goal = self._goal
        assert goal is not None and self._node.executor is not None
        problem, steps = "", goal.request.steps
        if self._node.stopping.is_set():
            problem = f"the node exits after {completed} steps"
        elif goal.is_cancel_requested:
            problem = f"canceled after {completed} steps"
        elif completed < steps:
            try:
                well, text = self._control.step(1)
                problem = "" if well else text
            except AbSimError as error:
                problem = str(error)
            if not problem:
                completed += 1
                goal.publish_feedback(
                    self._kind.Feedback(
                        completed_steps=completed, remaining_steps=steps - completed
                    )
                )
        if problem or completed >= steps:
            self._goal = None
            self._end(goal, problem)
        else:
            self._node.executor.create_task(self._continue, completed)

    def _end(self, goal: Goal, problem: str) -> None:
        """Set the result of a goal; ``problem`` is empty if it has succeeded."""
        result, codes = self._kind.Result(), self._codes
        result.result.result = codes.RESULT_OPERATION_FAILED if problem else codes.RESULT_OK
        result.result.error_message = problem
        self._server.end(goal, not problem, result)


NOT_FOUND = (
    "simulation_interfaces is not found: the drive has the services of std_srvs only; `make action`"
    " builds it for ROS from PyPI, a distribution has ros-ROS_DISTRO-simulation-interfaces"
)
_LONGEST_FILTER = 40
"""Largest number of characters of a filter for names. Longer regular expressions, and those with
repeated groups, may take seconds, in which the drive is stopped."""
_MOST_STEPS = 10_000
"""Largest number of wake-ups in one request; meanwhile, no other request is answered."""


class RefusedRequest(Exception):
    """Refusal of a request, with a result code of the standard."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


class Offer(NamedTuple):
    """Service of the standard that a drive offers."""

    kind: str
    """Name of the service's type."""
    fill: Callable[[Any, Any], None]
    """Function that fills the response (second argument) to a request (first argument)."""
    features: tuple[str, ...] = ()
    """Features of the standard that the service provides."""

    @property
    def name(self) -> str:
        """Name of the service, as in Gazebo: that of GetEntities is ~/get_entities."""
        return "~/" + re.sub(r"(?<!^)(?=[A-Z])", "_", self.kind).lower()


class SimulationServices:
    """Serves simulation_interfaces; if that package is missing, logs this instead.

    A step is a wake-up of the drive. Entities are deck, spindle and balls, in the housing's frame.
    Clients may load only scenes that come with ab_sim, or are in the folder of the parameter
    ``worlds``.

    Parameters
    ----------
    node
        Node of the drive.
    control
        Services of std_srvs, which do the work.
    """

    def __init__(self, node: DriveNode, control: DriveControl) -> None:
        self._node, self._control = node, control
        try:
            self._kinds = importlib.import_module("simulation_interfaces.srv")
            self._messages = importlib.import_module("simulation_interfaces.msg")
            action = importlib.import_module("simulation_interfaces.action").SimulateSteps
        except (ImportError, AttributeError):
            node.get_logger().info(NOT_FOUND)
            return
        self._codes = self._messages.Result
        resets = ("SIMULATION_RESET", "SIMULATION_RESET_TIME", "SIMULATION_RESET_STATE")
        states = ("SIMULATION_STATE_SETTING", "SIMULATION_STATE_PAUSE")
        steps = ("STEP_SIMULATION_SINGLE", "STEP_SIMULATION_MULTIPLE", "STEP_SIMULATION_ACTION")
        offers = (
            Offer("GetSimulatorFeatures", self._get_features),
            Offer("GetSimulationState", self._get_state, ("SIMULATION_STATE_GETTING",)),
            Offer("SetSimulationState", self._set_state, states),
            Offer("ResetSimulation", self._reset, resets),
            Offer("StepSimulation", self._step, steps),
            Offer("GetEntities", self._get_entities),
            Offer("GetEntityState", self._get_entity_state, ("ENTITY_STATE_GETTING",)),
            Offer("GetEntitiesStates", self._get_entities_states),
            Offer("SetEntityState", self._set_entity_state, ("ENTITY_STATE_SETTING",)),
            Offer("GetAvailableWorlds", self._get_worlds, ("AVAILABLE_WORLDS",)),
            Offer("GetCurrentWorld", self._get_world, ("WORLD_INFO_GETTING",)),
            Offer("LoadWorld", self._load_world, ("WORLD_LOADING",)),
        )
        # Versions before 2 of the package have no worlds.
        self._offers = [offer for offer in offers if hasattr(self._kinds, offer.kind)]
        for offer in self._offers:
            kind = getattr(self._kinds, offer.kind)
            node.create_service(kind, offer.name, self._answered(offer.fill))
        self._action = SimulateSteps(node, action, self._codes, control)

    def _answered(self, fill: Callable[[Any, Any], None]) -> Callable[[Any, Any], Any]:
        """Return the callback of a service, which reports a refusal in the response's result."""

        def callback(request: Any, response: Any) -> Any:
            code, text = self._codes.RESULT_OK, ""
            try:
                fill(request, response)
            except RefusedRequest as refusal:
                code, text = refusal.code, str(refusal)
            except CommandError as error:
                code, text = self._codes.RESULT_INCORRECT_STATE, str(error)
            except AbSimError as error:
                code, text = self._codes.RESULT_OPERATION_FAILED, str(error)
            if hasattr(response, "result"):  # the response of GetSimulatorFeatures has none
                response.result.result, response.result.error_message = code, text
            return response

        return callback

    def _done(self, answer: Answer, code: int | None = None) -> None:
        """Raise a refusal if the drive has refused; ``code``: its result code.

        Raises
        ------
        RefusedRequest
            The answer is a refusal.
        """
        if not answer[0]:
            raise RefusedRequest(
                self._codes.RESULT_OPERATION_FAILED if code is None else code, answer[1]
            )

    def _get_features(self, request: Any, response: Any) -> None:
        features = self._messages.SimulatorFeatures
        names = [name for offer in self._offers for name in offer.features]
        response.features.features = [getattr(features, name) for name in names]
        response.features.custom_info = (
            f"ab_sim {__version__}: a step is one wake-up, 1/wake_rate s of simulated time"
        )

    def _state(self) -> int:
        """Return the state of the simulation, by the constants of the standard."""
        states, session = self._messages.SimulationState, self._node.session
        if session is None:
            loading = self._node.is_configuring
            return int(states.STATE_LOADING_WORLD if loading else states.STATE_NO_WORLD)
        if session.active and not session.standing:
            return int(states.STATE_PLAYING)
        return int(states.STATE_STOPPED if session.stopped else states.STATE_PAUSED)

    def _get_state(self, request: Any, response: Any) -> None:
        response.state.state = self._state()

    def _set_state(self, request: Any, response: Any) -> None:
        states, wanted = self._messages.SimulationState, request.state.state
        if wanted == self._state():
            raise RefusedRequest(
                response.ALREADY_IN_TARGET_STATE, "the simulation is already in that state"
            )
        if wanted == states.STATE_QUITTING:
            assert self._node.executor is not None
            self._node.executor.create_task(self._node.stopping.set)  # after the answer
        elif wanted == states.STATE_STOPPED:
            self._done(self._control.stop())
        elif wanted == states.STATE_PAUSED:
            self._done(self._control.pause(True))
            with self._node.active() as session:
                session.stopped = False
        elif wanted == states.STATE_PLAYING:
            self._done(self._control.pause(False), response.STATE_TRANSITION_ERROR)
        else:
            raise RefusedRequest(
                self._codes.RESULT_FEATURE_UNSUPPORTED,
                f"state = {wanted}: must be 0 (stopped), 1 (playing), 2 (paused) or 3 (quitting)",
            )

    def _reset(self, request: Any, response: Any) -> None:
        resets = {
            request.SCOPE_DEFAULT: self._control.reset,
            request.SCOPE_ALL: self._control.reset,
            request.SCOPE_TIME | request.SCOPE_STATE: self._control.reset,
            request.SCOPE_TIME: self._control.reset_time,
            request.SCOPE_STATE: self._control.reset_state,
        }
        if request.scope not in resets:
            raise RefusedRequest(
                self._codes.RESULT_FEATURE_UNSUPPORTED,
                f"scope = {request.scope}: must be 1 (time), 2 (state), their sum, 0 or 255 (all); "
                "entities cannot be spawned",
            )
        self._done(resets[request.scope]())

    def _step(self, request: Any, response: Any) -> None:
        if request.steps > _MOST_STEPS:
            raise RefusedRequest(
                self._codes.RESULT_OPERATION_FAILED,
                f"steps = {request.steps}: must be at most {_MOST_STEPS}; the action "
                "simulate_steps takes more, and can be canceled",
            )
        self._done(self._control.step(request.steps))

    def _get_entities(self, request: Any, response: Any) -> None:
        with self._node.active() as session:
            response.entities = self._filtered(session, request.filters)

    def _get_entities_states(self, request: Any, response: Any) -> None:
        with self._node.active() as session:
            response.entities = self._filtered(session, request.filters)
            response.states = [self._entity_state(session, name) for name in response.entities]

    def _get_entity_state(self, request: Any, response: Any) -> None:
        with self._node.active() as session:
            self._check_entity(session, request.entity)
            response.state = self._entity_state(session, request.entity)

    def _set_entity_state(self, request: Any, response: Any) -> None:
        state, pose, velocity = request.state, request.state.pose, request.state.twist
        # Before version 2.1 there were no flags; a request without any sets both.
        flags = [getattr(request, f"set_{part}", False) for part in ("pose", "twist")]
        if not any(flags) and not getattr(request, "set_acceleration", False):
            flags = [True, True]
        p, q = pose.position, pose.orientation
        place = BodyPose((p.x, p.y, p.z), (q.w, q.x, q.y, q.z)) if flags[0] else None
        rates = BodyRates(_of(velocity.linear), _of(velocity.angular)) if flags[1] else None

        def leap(session: Session) -> None:
            self._check_entity(session, request.entity)
            if state.header.frame_id not in ("", self._frame):
                raise RefusedRequest(
                    self._codes.RESULT_FEATURE_UNSUPPORTED,
                    f"frame_id = {state.header.frame_id!r}: must be {self._frame} or empty",
                )
            try:
                to = moved(sound(session).now.drive, request.entity, place, rates)
            except InputError as error:
                raise RefusedRequest(response.INVALID_POSE, str(error)) from error
            session.commanded.restore(to)

        self._done(self._control.leap(leap, f"state of {request.entity} set"))

    @property
    def _frame(self) -> str:
        """Name of the housing's frame, in which entities are reported."""
        return frame_of(self._node.get_namespace(), HOUSING)

    def _check_entity(self, session: Session, name: str) -> None:
        """Refuse the name of an entity that does not exist."""
        names = body_names(session.now.scene)
        if name not in names:
            raise RefusedRequest(
                self._codes.RESULT_NOT_FOUND,
                f"entity {name!r} does not exist{nearest(name, names)}; there are "
                + ", ".join(names),
            )

    def _filtered(self, session: Session, filters: Any) -> list[str]:
        """Return the names of the entities that a request's filters select.

        Raises
        ------
        RefusedRequest
            The filters are not supported, or invalid.
        """
        if filters.categories or filters.tags.tags or filters.bounds.type:
            raise RefusedRequest(
                self._codes.RESULT_FEATURE_UNSUPPORTED,
                "filters: entities have names only, no categories, tags or bounds; use filter",
            )
        if len(filters.filter) > _LONGEST_FILTER or re.search(r"\)[*+{]", filters.filter):
            raise RefusedRequest(
                self._codes.RESULT_OPERATION_FAILED,
                f"filter: must have at most {_LONGEST_FILTER} characters, and repeat no group "
                "(...)",
            )
        try:
            wanted = re.compile(filters.filter or ".*")
        except re.error as error:
            raise RefusedRequest(
                self._codes.RESULT_OPERATION_FAILED,
                f"filter = {filters.filter!r}: must be a regular expression: {error}",
            ) from error
        return [name for name in body_names(session.now.scene) if wanted.fullmatch(name)]

    def _entity_state(self, session: Session, name: str) -> Any:
        """Return pose, velocity and acceleration of an entity as a message."""
        drive = session.now.drive
        pose, velocity, acceleration = motion_of(name, drive.scene, drive.observe())
        state = self._messages.EntityState()
        state.header.frame_id = self._frame
        time = state.header.stamp
        time.sec, time.nanosec = divmod(session.now.time_ns, 10**9)
        p, q = state.pose.position, state.pose.orientation
        p.x, p.y, p.z = pose.position
        q.w, q.x, q.y, q.z = pose.turn
        for message, rates in ((state.twist, velocity), (state.acceleration, acceleration)):
            for vector, values in zip((message.linear, message.angular), rates, strict=True):
                vector.x, vector.y, vector.z = values
        return state

    def _worlds(self) -> dict[str, Path]:
        """Return the files of the scenes that clients may load, by URI."""
        files = {name: find_scene(name) for name in scene_names()}
        if folder := self._node.settings.values["worlds"]:
            files |= {path.name: path for path in sorted(path_of(folder).glob("*.yaml"))}
        return files

    def _world(self, uri: str, path: Path) -> Any:
        """Return the message that describes a scene; without a description if it is invalid."""
        world = self._messages.WorldResource(name=path.stem)
        world.world_resource.uri = uri
        with contextlib.suppress(SceneError):
            world.description = str(read_scene_file(find_scene(path)).get("description", ""))
        return world

    def _get_worlds(self, request: Any, response: Any) -> None:
        if request.filter.tags or (request.additional_sources and not request.continue_on_error):
            raise RefusedRequest(
                self._codes.RESULT_FEATURE_UNSUPPORTED,
                "worlds have no tags, and a request cannot name further sources; the parameter "
                "worlds names a folder of them",
            )
        response.worlds = [self._world(*world) for world in self._worlds().items()]

    def _get_world(self, request: Any, response: Any) -> None:
        if (session := self._node.session) is None:
            raise RefusedRequest(response.NO_WORLD_LOADED, "no scene is loaded")
        scene = session.now.scene
        response.world.name, response.world.description = scene.name, scene.description
        response.world.world_resource.uri = scene.name if scene.name in self._worlds() else ""

    def _load_world(self, request: Any, response: Any) -> None:
        resource = getattr(request, "world_resource", request)  # before version 2.1
        if not resource.uri:
            raise (
                RefusedRequest(
                    self._codes.RESULT_FEATURE_UNSUPPORTED,
                    "resource_string: not supported; give a uri that get_available_worlds lists",
                )
                if resource.resource_string
                else RefusedRequest(
                    response.NO_RESOURCE, "uri: is empty; give one that get_available_worlds lists"
                )
            )
        worlds = self._worlds()
        if (path := worlds.get(resource.uri)) is None:
            raise RefusedRequest(
                self._codes.RESULT_NOT_FOUND,
                f"uri = {resource.uri!r}: unknown{nearest(resource.uri, worlds)}; it must be one "
                "that get_available_worlds lists: a scene of ab_sim, or a file in the folder of "
                "the parameter worlds",
            )
        with self._node.active():
            pass  # refuse an inactive node before its parameters are changed
        scene = resource.uri if path.stem == resource.uri else str(path)
        accepted = self._node.set_parameters_atomically(
            [Parameter("scene", value=scene), Parameter("changes", value=[""])]
        )
        self._done((accepted.successful, accepted.reason), response.RESOURCE_PARSE_ERROR)
        self._done(self._control.load_scene(stopped=True))
        response.world = self._world(resource.uri, path)


def _of(vector: Any) -> tuple[float, float, float]:
    """Return the components of a geometry_msgs/Vector3."""
    return vector.x, vector.y, vector.z

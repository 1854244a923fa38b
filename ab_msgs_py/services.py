"""Services of the contract, after ROS's simulation_interfaces, with std_srvs types."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.service import Service
from std_srvs.srv import SetBool, Trigger

from ab_msgs_py.ros_messages import MalformedMessage

PAUSE = "~/pause"
"""SetBool: true pauses, false resumes."""
STEP = "~/step"
"""Trigger: simulate the number of wake-ups in the parameter `steps`; refused unless time is paused.
The text of the answer is a ``Stepped``."""
RESET = "~/reset"
"""Trigger: return to t = 0 and the start state; commands are discarded."""
RESET_TIME = "~/reset_time"
"""Trigger: return to t = 0 and keep the present state."""
RESET_STATE = "~/reset_state"
"""Trigger: return to the start state and keep the time; commands are discarded."""
LOAD_SCENE = "~/load_scene"
"""Trigger: load the scene that the parameters `scene` and `changes` name, from t = 0."""
LOAD_DISC = "~/load_disc"
"""Trigger: load the disc that the parameters `disc_eccentricity` and `disc_angle` describe; refused
if `disc_eccentricity` is not set."""
INJECT_FAULTS = "~/inject_faults"
"""Trigger: replace all faults by those in the parameter `faults`."""
CLEAR_FAULTS = "~/clear_faults"
"""Trigger: remove all faults."""
SAVE_SNAPSHOT = "~/save_snapshot"
"""Trigger: save the present state to the file that the parameter `snapshot` names."""
RESTORE_SNAPSHOT = "~/restore_snapshot"
"""Trigger: return to the state in the file that the parameter `snapshot` names."""
EMERGENCY_STOP = "~/emergency_stop"
"""Trigger: stop the spindle as fast as possible; commands are ignored until
``RESET_EMERGENCY_STOP``."""
RESET_EMERGENCY_STOP = "~/reset_emergency_stop"
"""Trigger: follow commands again after an emergency stop."""
CHANGE_STATE = "~/change_state"
"""ChangeState of lifecycle_msgs: configure, activate, deactivate, cleanup or shutdown."""
START = "~/start"
"""Trigger: run the profile."""
ABORT = "~/abort"
"""Trigger: stop the profile and ramp down to standstill."""

Answer = tuple[bool, str]
"""Success of a request, and a text for users."""


class Stepped(NamedTuple):
    """Result of a ``STEP`` request, sent as JSON in the answer's text.

    The samples of the steps are published before the answer.
    """

    sim_time_ns: int
    """Simulated time [ns]."""
    wakes: int
    """Number of simulated wake-ups."""
    commands: int
    """Number of commands received since the last wake-up of a request, or since a reset that
    discards commands, including rejected and ignored ones. The diagnostics have the total."""

    @property
    def text(self) -> str:
        """Return the text of an answer."""
        return json.dumps(self._asdict())

    @classmethod
    def of(cls, text: str) -> Stepped:
        """Return the progress in the text of an answer.

        Raises
        ------
        MalformedMessage
            The text is not such an answer.
        """
        try:
            return cls(**{key: int(value) for key, value in json.loads(text).items()})
        except (AttributeError, RecursionError, TypeError, ValueError) as error:
            raise MalformedMessage(f"not the answer of {STEP}: {text!r}") from error


def serve_trigger(node: Node, name: str, act: Callable[[], Answer]) -> Service[Any, Any]:
    """Advertise a Trigger service that calls ``act``."""

    def callback(request: Any, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = act()
        return response

    return node.create_service(Trigger, name, callback)


def answer_waiting(service: Service[Any, Any]) -> None:
    """Answer the pending requests of a service that no executor serves."""
    with service.handle:
        while True:
            request, sender = service.handle.service_take_request(service.srv_type.Request)
            if sender is None:
                return
            service.send_response(service.callback(request, service.srv_type.Response()), sender)


def serve_switch(node: Node, name: str, act: Callable[[bool], Answer]) -> None:
    """Advertise a SetBool service that calls ``act`` with the request's value."""

    def callback(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = act(bool(request.data))
        return response

    node.create_service(SetBool, name, callback)


def trigger_request() -> Trigger.Request:
    """Return a request for a Trigger service."""
    return Trigger.Request()


def switch_request(on: bool) -> SetBool.Request:
    """Return a request for a SetBool service."""
    return SetBool.Request(data=on)


def answer_of(response: Any) -> Answer:
    """Return success and text of a response."""
    return bool(response.success), str(response.message)

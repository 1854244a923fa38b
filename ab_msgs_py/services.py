"""Services of the contract, after ROS's simulation_interfaces, with std_srvs types."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.service import Service
from std_srvs.srv import SetBool, Trigger

from ab_msgs_py.errors import MalformedMessage

PAUSE = "~/pause"
"""SetBool: true pauses, false resumes."""
STEP = "~/step"
"""Trigger: as many wake-ups as the parameter `steps` says; refused unless time stands still. The
answer's text is a ``Stepped``."""
RESET = "~/reset"
"""Trigger: back to t = 0 and the start; commands are forgotten."""
RESET_TIME = "~/reset_time"
"""Trigger: back to t = 0 in the present state."""
RESET_STATE = "~/reset_state"
"""Trigger: back to the start's state, and time goes on; commands are forgotten."""
LOAD_SCENE = "~/load_scene"
"""Trigger: the scene that the parameters `scene` and `changes` name, from t = 0."""
LOAD_DISC = "~/load_disc"
"""Trigger: the disc that the parameters `disc_eccentricity` and `disc_angle` name, from now on;
refused if nobody has set the first."""
INJECT_FAULTS = "~/inject_faults"
"""Trigger: the faults that the parameter `faults` names, instead of those in force."""
CLEAR_FAULTS = "~/clear_faults"
"""Trigger: no faults any more."""
SAVE_SNAPSHOT = "~/save_snapshot"
"""Trigger: the present, to the file that the parameter `snapshot` names."""
RESTORE_SNAPSHOT = "~/restore_snapshot"
"""Trigger: back to what that file holds."""
EMERGENCY_STOP = "~/emergency_stop"
"""Trigger: to standstill as fast as the spindle can; commands are ignored from now on."""
RESET_EMERGENCY_STOP = "~/reset_emergency_stop"
"""Trigger: commands are followed again."""
CHANGE_STATE = "~/change_state"
"""ChangeState of lifecycle_msgs: configure, activate, deactivate, cleanup or shutdown."""
START = "~/start"
"""Trigger: run the profile."""
ABORT = "~/abort"
"""Trigger: stop the profile and ramp down to standstill."""

Answer = tuple[bool, str]
"""Whether it was done, and a text for people."""


class Stepped(NamedTuple):
    """How far ``STEP`` has gone, as JSON in its answer; all of it has been published by then."""

    sim_time_ns: int
    """Simulated time [ns]."""
    wakes: int
    """Wake-ups that were taken."""
    commands: int
    """That have come since the answer before, or since a reset that has forgotten them; those
    rejected or ignored included. What the drive has heard in all is in its diagnostics."""

    @property
    def text(self) -> str:
        """For the answer."""
        return json.dumps(self._asdict())

    @classmethod
    def of(cls, text: str) -> Stepped:
        """Out of an answer.

        Raises:
            MalformedMessage: it is none.
        """
        try:
            return cls(**{key: int(value) for key, value in json.loads(text).items()})
        except (AttributeError, RecursionError, TypeError, ValueError) as error:
            raise MalformedMessage(f"not the answer of {STEP}: {text!r}") from error


def serve_trigger(node: Node, name: str, act: Callable[[], Answer]) -> Service[Any, Any]:
    """Offer a Trigger service."""

    def callback(request: Any, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = act()
        return response

    return node.create_service(Trigger, name, callback)


def answer_waiting(service: Service[Any, Any]) -> None:
    """Answer what has been asked of a service that no executor answers."""
    with service.handle:
        while True:
            asked = service.handle.service_take_request(service.srv_type.Request)
            if asked[1] is None:
                return
            service.send_response(service.callback(asked[0], service.srv_type.Response()), asked[1])


def serve_switch(node: Node, name: str, act: Callable[[bool], Answer]) -> None:
    """Offer a SetBool service."""

    def callback(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = act(bool(request.data))
        return response

    node.create_service(SetBool, name, callback)


def trigger_request() -> Trigger.Request:
    """A request for a Trigger service."""
    return Trigger.Request()


def switch_request(on: bool) -> SetBool.Request:
    """A request for a SetBool service."""
    return SetBool.Request(data=on)


def answer_of(response: Any) -> Answer:
    """Whether it was done, and why not."""
    return bool(response.success), str(response.message)

"""Services of the contract, after ROS's simulation_interfaces, with std_srvs types."""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

PAUSE = "~/pause"
"""SetBool: true pauses, false resumes."""
STEP = "~/step"
"""Trigger: one wake-up's steps; refused unless paused."""
RESET = "~/reset"
"""Trigger: back to t = 0."""
START = "~/start"
"""Trigger: run the profile."""
ABORT = "~/abort"
"""Trigger: stop the profile and command standstill."""

Answer = tuple[bool, str]
"""Whether it was done, and a text for people."""


def serve_trigger(node: Node, name: str, act: Callable[[], Answer]) -> None:
    """Offer a Trigger service."""

    def callback(request: Any, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = act()
        return response

    node.create_service(Trigger, name, callback)


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

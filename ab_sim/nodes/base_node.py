"""Base class of all nodes."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node
from rclpy.service import Service

from ab_msgs_py.services import Answer, serve_switch, serve_trigger
from ab_sim.base.errors import AbSimError, visible


class BaseNode(Node):
    """Node whose log has no control characters, and whose services turn an AbSimError to a refusal.

    As a base class, it must come before ``LifecycleNode``.
    """

    def get_logger(self) -> RcutilsLogger:
        """Return the node's logger, which makes control characters in messages visible."""
        return _Logger(super().get_logger().name)

    def offer(self, service: str, act: Callable[[], Answer]) -> Service[Any, Any]:
        """Advertise a Trigger service that calls ``act``; an AbSimError becomes its refusal."""
        return serve_trigger(self, service, _answered(act))

    def offer_switch(self, service: str, act: Callable[[bool], Answer]) -> None:
        """Advertise a SetBool service that calls ``act``; an AbSimError becomes its refusal."""
        serve_switch(self, service, _answered(act))


def _answered(act: Callable[..., Answer]) -> Callable[..., Answer]:
    """Return ``act`` with AbSimErrors turned to refusals, so that they do not end the node."""

    @functools.wraps(act)
    def answer(*values: bool) -> Answer:
        try:
            return act(*values)
        except AbSimError as error:
            return False, str(error)

    return answer


class _Logger(RcutilsLogger):
    """Logger with one call per severity: rclpy allows each calling line one severity only."""

    def info(self, message: str, **filters: Any) -> bool:
        return super().info(visible(message), **filters)

    def warning(self, message: str, **filters: Any) -> bool:
        return super().warning(visible(message), **filters)

    def error(self, message: str, **filters: Any) -> bool:
        return super().error(visible(message), **filters)

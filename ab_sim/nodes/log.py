"""Log of a node, with control characters removed that could act on a terminal."""

from typing import Any

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node

from ab_sim.quoting import visible


class PlainLog(Node):
    """Base class of nodes, to be listed before ``Node``."""

    def get_logger(self) -> RcutilsLogger:
        """Return Node's logger, with sanitised messages."""
        return _Logger(super().get_logger().name)


class _Logger(RcutilsLogger):
    """Logger with a call per severity: rclpy allows each calling line one severity only."""

    def info(self, message: str, **filters: Any) -> bool:
        return super().info(visible(message), **filters)

    def warning(self, message: str, **filters: Any) -> bool:
        return super().warning(visible(message), **filters)

    def error(self, message: str, **filters: Any) -> bool:
        return super().error(visible(message), **filters)

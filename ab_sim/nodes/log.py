"""A node's log, in which nothing from outside acts on a terminal."""

from typing import Any

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node

from ab_sim.quoting import visible


class PlainLog(Node):
    """To be derived from by nodes, before ``Node`` itself."""

    def get_logger(self) -> RcutilsLogger:
        """As Node's, but for what it is told."""
        return _Logger(super().get_logger().name)


class _Logger(RcutilsLogger):
    """rclpy tells callers apart by their lines, and allows one severity for each."""

    def info(self, message: str, **filters: Any) -> bool:
        return super().info(visible(message), **filters)

    def warning(self, message: str, **filters: Any) -> bool:
        return super().warning(visible(message), **filters)

    def error(self, message: str, **filters: Any) -> bool:
        return super().error(visible(message), **filters)

"""Somebody who took another type for that of commands, and says nothing until interrupted."""

import contextlib

import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Float32


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("mistaken")
    node.create_publisher(Float32, "spindle/command", 1)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()

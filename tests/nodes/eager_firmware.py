"""Firmware that commands the drive 50 times a second."""

import time

import rclpy
from std_msgs.msg import Float64


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("eager_firmware")
    publisher = node.create_publisher(Float64, "spindle/command", 10)
    while rclpy.ok():
        publisher.publish(Float64(data=5.0))
        time.sleep(0.02)


if __name__ == "__main__":
    main()

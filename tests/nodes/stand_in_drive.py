"""Drive that is not ab_sim: standard topics as of a board, on its own clock.

It vibrates until it has been at 50 rad/s for half a second, as if balls had balanced it. When it
has stopped after that, its sensor fails.
"""

import math
import time

import rclpy
from geometry_msgs.msg import AccelStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64

BOARD = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
PERIOD = 0.005


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("board")
    heard = [0.0]
    node.create_subscription(Float64, "spindle/command", lambda m: heard.append(m.data), BOARD)
    vibration = node.create_publisher(AccelStamped, "vibration", BOARD)
    held, runs, fast = 0.0, 0, False
    while rclpy.ok():
        end = time.monotonic() + PERIOD
        while (left := end - time.monotonic()) > 0:
            rclpy.spin_once(node, timeout_sec=left)
        speed = heard[-1]
        fast = fast or speed == 50.0
        held = held + PERIOD if speed == 50.0 else 0.0
        if fast and speed == 0.0:
            fast, runs = False, runs + 1
            last = len(heard) - heard[::-1].index(50.0)
            steps = sum(0.0 < speed < 50.0 for speed in heard[last:])
            print(f"stands still again, {runs}, by {steps} steps", flush=True)
        if runs == 0:
            message = AccelStamped()
            message.header.frame_id = "imu"
            message.header.stamp = node.get_clock().now().to_msg()
            large = 0.1 if held > 0.5 else 3.0
            message.accel.linear.x = large * math.sin(200.0 * time.monotonic())
            message.accel.linear.z = 9.81
            vibration.publish(message)


if __name__ == "__main__":
    main()

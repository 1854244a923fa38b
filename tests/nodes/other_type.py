"""Node with a wrong message type for commands, which publishes nothing until interrupted."""

import signal
import threading

import rclpy
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float32


def main() -> None:
    stopping = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: stopping.set())
    # With rclpy's own handlers one that was interrupted has not ended, once.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("mistaken")
    node.create_publisher(Float32, "spindle/command", 1)
    while not stopping.is_set():
        rclpy.spin_once(node, timeout_sec=0.05)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()

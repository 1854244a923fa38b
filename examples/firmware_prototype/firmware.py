#!/usr/bin/env python3
"""Start-up firmware on a PC: starts a drive over its topics, as a board would.

It needs only the topics of docs/topics.md: it imports ROS's standard messages, and ``start_up.py``
in this folder, which decides on the speed.
"""

import argparse
import dataclasses
import math
import os
import signal
import sys
import time

import rclpy
from geometry_msgs.msg import AccelStamped
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from start_up import Settings, StartUp
from std_msgs.msg import Float64

PERIOD = 0.005
"""Time between two commands [s]."""
LISTENING = 0.001
"""Longest wait for a message [s]."""
QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)


class Firmware(Node):
    """Inputs and outputs of the board: three topics."""

    def __init__(self, start_up: StartUp) -> None:
        super().__init__("firmware")
        self.start_up = start_up
        self._sensor: str | None = None
        self._command = self.create_publisher(Float64, "spindle/command", QOS)
        self.create_subscription(JointState, "joint_states", self._spindle, QOS)
        self.create_subscription(AccelStamped, "vibration", self._vibration, QOS)

    def tick(self, passed: float) -> None:
        """Decide on the speed and command it; ``passed``: time since the last call [s]."""
        speed = self.start_up.tick(passed)
        if self.start_up.state != "waiting":
            self._command.publish(Float64(data=speed))

    def leave(self) -> None:
        """Wait until the last command has arrived: the exit of the process could lose it."""
        self._command.wait_for_all_acked(Duration(seconds=1))

    def _spindle(self, message: JointState) -> None:
        names = list(message.name)
        if "spindle" in names and len(message.position) == len(message.velocity) == len(names):
            i = names.index("spindle")
            self.start_up.spindle(stamp_of(message), message.position[i], message.velocity[i])

    def _vibration(self, message: AccelStamped) -> None:
        # Several accelerometers may share the topic: use the first one received.
        if self._sensor is None:
            self._sensor = message.header.frame_id
        if message.header.frame_id == self._sensor:
            linear = message.accel.linear
            self.start_up.vibration(stamp_of(message), linear.x, linear.y)


def stamp_of(message: JointState | AccelStamped) -> float:
    """Return the simulated time of a sample [s]."""
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def run(firmware: Firmware, executor: SingleThreadedExecutor) -> None:
    """Run the loop at a fixed rate until the start-up is in the state off."""
    deadline = time.monotonic() + PERIOD
    while firmware.start_up.state != "off":
        # The time-out is constant: if it changed, rclpy would begin again with the first
        # subscription, and on a busy machine never read the others.
        while (late := time.monotonic() - deadline) < 0.0:
            executor.spin_once(timeout_sec=LISTENING)
        # A late tick counts as all the periods that have passed.
        periods = 1 + math.floor(late / PERIOD)
        deadline += periods * PERIOD
        firmware.tick(periods * PERIOD)


def settings_of(arguments: list[str]) -> Settings:
    """Return the settings from the command line, which has an option for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    for field in dataclasses.fields(Settings):
        option = f"--{field.name.replace('_', '-')}"
        parser.add_argument(option, type=positive, default=field.default, metavar="X")
    return Settings(**vars(parser.parse_args(arguments)))


def positive(text: str) -> float:
    """Parse a finite number above 0."""
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}: must be a finite number above 0")
    return value


def main() -> int:
    """Run until Ctrl-C or a failure; a second Ctrl-C exits while the spindle turns."""
    start_up = StartUp(settings_of(remove_ros_args(sys.argv)[1:]), say)

    def interrupted(number: int, frame: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        start_up.stop()

    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    executor = SingleThreadedExecutor()
    firmware = Firmware(start_up)
    executor.add_node(firmware)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupted)
    say("waiting: for a drive")
    run(firmware, executor)
    firmware.leave()
    executor.shutdown()
    firmware.destroy_node()
    rclpy.shutdown()
    return int(start_up.failed)


def say(text: str) -> None:
    """Print a line without buffering, also into a file or a pipe."""
    print(text, flush=True)


if __name__ == "__main__":
    sys.exit(main())

"""Test bench for firmware: a simulated drive that advances only on request.

Needs ``rclpy``, standard messages and a ``drive_sim`` node. Time stands still between two calls of
``period``, so that results do not depend on the machine's speed, and repeat bit for bit.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import rclpy
from geometry_msgs.msg import AccelStamped, PointStamped
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

DRIVE = (sys.executable, "-m", "ab_sim.nodes.drive_sim")
"""Command that starts the drive; with your own ROS 2: ("ros2", "run", "ab_sim", "drive_sim")."""
WAKES_PER_PERIOD, WAKE_RATE = 5, 1000.0
PERIOD = WAKES_PER_PERIOD / WAKE_RATE
"""Simulated time between two commands of the firmware [s]."""
DEADLINE = 120.0
"""Longest wait for the drive [s]. It only ends a test whose drive has failed."""
QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)


class Bench:
    """Drive in lock step, and the topics that connect firmware to it.

    Messages of the last period are in ``joints``, ``vibrations`` and ``whirls``, oldest first. A
    period is over when the newest message of each has arrived, except those of ``silent``.

    Parameters
    ----------
    scene
        Name or file of the drive.
    log
        File for the drive's output.
    parameters
        Further parameters of ``drive_sim``.
    """

    def __init__(self, scene: str, log: Path, **parameters: object) -> None:
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        self._log = log
        settings = {
            "scene": scene,
            "time_mode": "lock_step",
            "wake_rate": WAKE_RATE,
            "steps": WAKES_PER_PERIOD,
            "await_commands": 1,
            **parameters,
        }
        words = [word for name, value in settings.items() for word in ("-p", f"{name}:={value}")]
        with log.open("wb") as output:
            self._process = subprocess.Popen(
                [*DRIVE, "--ros-args", *words], stdout=output, stderr=subprocess.STDOUT
            )
        self._context = rclpy.Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node("bench", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._command = self._node.create_publisher(Float64, "spindle/command", QOS)
        self.joints: list[JointState] = []
        self.vibrations: list[AccelStamped] = []
        self.whirls: list[PointStamped] = []
        for kind, topic, messages in (
            (JointState, "joint_states", self.joints),
            (AccelStamped, "vibration", self.vibrations),
            (PointStamped, "whirl", self.whirls),
        ):
            self._node.create_subscription(kind, topic, messages.append, QOS)
        self.silent: list[list] = []
        """Lists that a fault keeps empty, for example ``[bench.vibrations]``."""
        self._step = self._node.create_client(Trigger, "drive_sim/step")
        self._set = self._node.create_client(
            SetParametersAtomically, "drive_sim/set_parameters_atomically"
        )
        self._wait(self._is_connected, "the drive is ready")

    def period(self, speed: float) -> None:
        """Command a speed [rad/s] and advance the drive by one period."""
        self._command.publish(Float64(data=speed))
        topics = (self.joints, self.vibrations, self.whirls)
        for messages in topics:
            messages.clear()
        end = json.loads(self._trigger(self._step))["sim_time_ns"]
        # Messages are sent before the answer, but the executor may take the answer first.
        awaited = [m for m in topics if not any(m is silent for silent in self.silent)]
        self._wait(
            lambda: all(m and stamp_ns(m[-1]) == end for m in awaited),
            f"messages of {end} ns arrive",
        )

    def inject(self, *faults: str) -> None:
        """Inject faults, for example ``"vibration drops 1"``; docs/topics.md lists them."""
        request = SetParametersAtomically.Request(
            parameters=[Parameter("faults", value=list(faults)).to_parameter_msg()]
        )
        result = self._answer(self._set, request).result
        assert result.successful, result.reason
        self._trigger(self._node.create_client(Trigger, "drive_sim/inject_faults"))

    def reset(self) -> None:
        """Return the drive to its start state at time 0."""
        self._trigger(self._node.create_client(Trigger, "drive_sim/reset"))

    def close(self) -> None:
        """Stop the drive and leave ROS."""
        self._process.terminate()
        self._process.wait(DEADLINE)
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def _is_connected(self) -> bool:
        clients = self._step.service_is_ready() and self._set.service_is_ready()
        return clients and self._command.get_subscription_count() > 0

    def _trigger(self, client: rclpy.client.Client) -> str:
        answer = self._answer(client, Trigger.Request())
        assert answer.success, f"{client.srv_name}: {answer.message}"
        return answer.message

    def _answer(self, client: rclpy.client.Client, request: object) -> object:
        self._wait(client.service_is_ready, f"{client.srv_name} is available")
        future = client.call_async(request)
        self._wait(future.done, f"{client.srv_name} answers")
        return future.result()

    def _wait(self, condition: object, what: str) -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            code = self._process.poll()
            assert code is None, f"the drive exited with {code}:\n{self._log.read_text()}"
            assert time.monotonic() < deadline, f"not within {DEADLINE:g} s: {what}"
            self._executor.spin_once(timeout_sec=0.05)


def stamp_ns(message: JointState | AccelStamped | PointStamped) -> int:
    """Return a message's simulated time [ns]."""
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec

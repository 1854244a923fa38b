"""Three nodes in processes of their own, started, watched and stopped by the demo."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import SetBool, Trigger

from ab_msgs_py import Health, JointSample, VectorSample, topics
from ab_msgs_py.services import answer_of, switch_request, trigger_request
from ab_sim.errors import AbSimError, InputError
from ab_sim.scene import Scene

READY = 90.0
"""s for the nodes to come up; the first time, the kernel is compiled meanwhile."""
ANSWER = 10.0
"""s for a service to answer, and for a node to end."""
SILENCE = 10.0
"""s without a word from the drive before the run is given up."""


class LiveRun:
    """A live run of a scene: use it as a context, which ends the nodes whatever happens.

    Args:
        scene: its name is handed to the nodes.
        recording: .rrd file that the recorder writes.
        logs: folder for what the nodes print.
    """

    def __init__(self, scene: Scene, recording: Path, logs: Path) -> None:
        self._scene, self._recording, self._logs = scene, recording, logs
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._health: dict[str, Health] = {}
        self._heard = time.monotonic()
        self._began: float | None = None
        self._wall = [0.0, 0.0]
        self.time = self.speed = self.whirl = 0.0
        self.ball_angles: tuple[float, ...] = ()

    def __enter__(self) -> "LiveRun":
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        try:
            self._watch()
            self._refuse_company()
            self._start_processes()
            self._wait_until_ready()
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end()

    @property
    def elapsed(self) -> float:
        """Simulated time since the profile started [s]."""
        return 0.0 if self._began is None else self.time - self._began

    def start(self) -> None:
        """Let the drive run, and start the profile."""
        self._ask(SetBool, "drive_sim/pause", switch_request(False))
        self._ask(Trigger, "profile_controller/start", trigger_request())
        self._began = self.time
        self._heard = time.monotonic()

    def spin(self, seconds: float) -> None:
        """Listen to the nodes for a while.

        Raises:
            AbSimError: one of them has ended, or the drive has fallen silent.
        """
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)
        for name, process in self._processes.items():
            if process.poll() is not None:
                raise AbSimError(
                    f"{name} ended with exit code {process.returncode}:\n{self._log_of(name)}"
                )
        if self._began is not None and time.monotonic() - self._heard > SILENCE:
            raise AbSimError(f"nothing heard from drive_sim for {SILENCE:g} s; see {self._logs}")

    def stop(self) -> dict[str, str]:
        """End the nodes, the recorder last; returns figures of the run, ready to print.

        Raises:
            AbSimError: a node did not end cleanly.
        """
        factor = (self._wall[1] - self._wall[0]) and self.elapsed / (self._wall[1] - self._wall[0])
        # Diagnostics come once a second: hear the last of them before the nodes go.
        self.spin(1.2)
        drive = self._health.get("/drive_sim")
        recorder = self._health.get("/recorder")
        if drive is None or recorder is None:
            raise AbSimError(f"no diagnostics came from drive_sim or recorder; see {self._logs}")
        for name in list(self._processes):
            code = self._stop_process(name)
            if code != 0:
                raise AbSimError(f"{name} ended with exit code {code}:\n{self._log_of(name)}")
        return {
            "real-time factor": f"{factor:.4f}",
            "worst lateness [ms]": f"{1e3 * float(drive.values['worst lateness [s]']):.2f}",
            "steps dropped": drive.values["steps dropped"],
            "commands accepted": drive.values["commands accepted"],
            "commands rejected": drive.values["commands rejected"],
            "messages dropped by the recorder": recorder.values["messages dropped"],
        }

    def _watch(self) -> None:
        self._node = rclpy.create_node("demo")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        topics.JOINT_STATES.subscription(self._node, self._hear_joints)
        topics.WHIRL.subscription(self._node, self._hear_whirl)
        topics.DIAGNOSTICS.subscription(self._node, self._hear_health)

    def _hear_joints(self, message: Any) -> None:
        sample = JointSample.of(message)
        self.time, self.speed = sample.time * 1e-9, sample.spindle_speed
        self.ball_angles = sample.ball_angles
        self._heard = time.monotonic()
        if self._began is not None:
            self._wall[1] = self._heard
            self._wall[0] = self._wall[0] or self._heard - self.elapsed

    def _hear_whirl(self, message: Any) -> None:
        sample = VectorSample.of_whirl(message)
        self.whirl = (sample.x**2 + sample.y**2) ** 0.5

    def _hear_health(self, message: Any) -> None:
        for health in Health.all_of(message):
            self._health[health.node] = health

    def _refuse_company(self) -> None:
        self._spin_until(lambda: self._node.count_publishers("/clock") > 0, 1.0)
        if self._node.count_publishers("/clock"):
            domain = os.environ.get("ROS_DOMAIN_ID", "0")
            raise InputError(
                f"another simulator publishes /clock on ROS_DOMAIN_ID {domain}; "
                "stop it, or run the demo on another domain: ROS_DOMAIN_ID=17 make demo"
            )

    def _start_processes(self) -> None:
        self._logs.mkdir(parents=True, exist_ok=True)
        scene = self._scene.name
        parameters = {
            "drive_sim": {"scene": scene, "start_paused": "true"},
            "profile_controller": {"profile": scene, "use_sim_time": "true"},
            "recorder": {"path": str(self._recording)},
        }
        for name, values in parameters.items():
            settings = [part for k, v in values.items() for part in ("-p", f"{k}:={v}")]
            command = [sys.executable, "-m", f"ab_sim.nodes.{name}", "--ros-args", *settings]
            with (self._logs / f"{name}.log").open("wb") as log:
                self._processes[name] = subprocess.Popen(
                    command,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    # Ctrl-C is for this process, which then ends them in order.
                    start_new_session=True,
                )

    def _wait_until_ready(self) -> None:
        def ready() -> bool:
            recorder = self._health.get("/recorder")
            return (
                recorder is not None
                and recorder.message == "recording"
                and self._node.count_publishers("/spindle/command") > 0
                and self._node.count_subscribers("/spindle/command") > 1
            )

        if not self._spin_until(ready, READY):
            raise AbSimError(f"the nodes did not come up within {READY:g} s; see {self._logs}")

    def _spin_until(self, condition: Callable[[], bool], deadline: float) -> bool:
        end = time.monotonic() + deadline
        while not condition():
            if time.monotonic() > end:
                return False
            self.spin(0.02)
        return True

    def _ask(self, kind: Any, service: str, request: Any) -> None:
        client = self._node.create_client(kind, service)
        if not client.wait_for_service(timeout_sec=ANSWER):
            raise AbSimError(f"the service {service} did not come up within {ANSWER:g} s")
        future = client.call_async(request)
        if not self._spin_until(future.done, ANSWER):
            raise AbSimError(f"the service {service} did not answer within {ANSWER:g} s")
        done, text = answer_of(future.result())
        if not done:
            raise AbSimError(f"the service {service} refused: {text}")

    def _stop_process(self, name: str) -> int:
        process = self._processes.pop(name)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            if process.poll() is None:
                process.send_signal(number)
            try:
                return process.wait(timeout=ANSWER)
            except subprocess.TimeoutExpired:
                continue
        return process.wait()

    def _log_of(self, name: str) -> str:
        text = (self._logs / f"{name}.log").read_text(errors="replace")
        return "\n".join(text.splitlines()[-15:])

    def _end(self) -> None:
        for name in list(self._processes):
            self._stop_process(name)
        if rclpy.ok():
            self._executor.shutdown()
            self._node.destroy_node()
            rclpy.try_shutdown()

"""Nodes of a live run, in separate processes that one command starts, monitors and stops."""

from __future__ import annotations

import contextlib
import ctypes
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import rclpy
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import SetBool, Trigger

from ab_msgs_py import ENDED, Health, MalformedMessage, topics
from ab_msgs_py.services import answer_of, switch_request, trigger_request
from ab_sim.base import interruption
from ab_sim.base.errors import AbSimError, InputError, Interrupted
from ab_sim.base.plug_ins import loaded_files
from ab_sim.nodes.process import init_ros, leave_graph
from ab_sim.scene import Scene
from ab_sim.show.viewing import STARTED

_READY = 90.0
"""Longest time for the nodes to start [s]; the first start includes compiling the kernel."""
_CONTROLLER, _RECORDER = "profile_controller", "recorder"
_ANSWER = 10.0
"""Longest time for a service to answer, and for a node to exit [s]."""
GLANCE = 0.02
"""Longest wait for the next message [s]."""
SILENCE = 10.0
"""Time without a message from the drive before the run is aborted [s]."""
_RUN_MODULE = (
    "import sys; sys.path[:] = filter(None, sys.path); module = sys.argv.pop(1); "
    "sys.argv[0] = '-m'; import runpy; "
    "runpy.run_module(module, run_name='__main__', alter_sys=True)"
)
"""Program that does the same as `python -m MODULE`, but does not import from the working directory,
where a user may have a folder `ab_sim`. `python -P` needs Python 3.11."""


class LiveRun:
    """Live run of a scene: a context manager that ends all nodes at its exit.

    Within the context, Ctrl-C raises ``Interrupted`` in the methods that wait for nodes.

    For a scene without a profile, no profile controller is started.

    Parameters
    ----------
    scene
        Scene of the run.
    source
        Name or file from which the nodes read the scene.
    changes
        Changes to the scene, each ``key=value``.
    recorder
        Parameters of the recorder; None: no recorder.
    logs
        Folder for the nodes' output.
    """

    def __init__(
        self,
        scene: Scene,
        source: str,
        changes: Sequence[str],
        recorder: Mapping[str, str] | None,
        logs: Path,
    ) -> None:
        what = {
            "changes": json.dumps([*changes] or [""]),
            "load": json.dumps([*loaded_files()] or [""]),
        }
        self._nodes: dict[str, Mapping[str, str]] = {}
        if scene.profile is not None:
            # The drive stands still until it has received the profile.
            controller = {"profile": source, "use_sim_time": "true", **what}
            if scene.profile.kind == "adaptive":
                controller["command_rate"] = repr(1.0 / scene.profile.command_period)
            self._nodes[_CONTROLLER] = controller
        self._nodes["drive_sim"] = {"scene": source, "start_paused": "true", **what}
        if recorder is not None:
            self._nodes[_RECORDER] = recorder
        self._logs = logs
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._context = contextlib.ExitStack()
        self._health: dict[str, Health] = {}
        self._last_message = time.monotonic()
        self._began: float | None = None
        self._wall = [0.0, 0.0]
        self.time = self.speed = self.whirl = 0.0
        self.ball_angles: tuple[float, ...] = ()
        self.statuses: list[tuple[float, str]] = []
        """Status texts of the profile controller with their times [s]."""

    def __enter__(self) -> LiveRun:
        try:
            self._stopping = self._context.enter_context(interruption.in_order())
            # Before there are other threads: a new process first runs `_end_with_parent`, which
            # could wait forever for a lock that another thread held at the fork.
            self._start_processes()
            init_ros(["ab-sim"])
            self._subscribe()
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
        """Simulated time since the profile started, or since the last reset [s]."""
        return 0.0 if self._began is None else self.time - self._began

    def wait_until_ready(self) -> None:
        """Wait until all nodes and the viewer, if any, are up and the services answer.

        Raises
        ------
        AbSimError
            The nodes do not start within ``_READY``, or one of them has exited.
        InputError
            Another simulator is running on this domain.
        """

        def ready() -> bool:
            self._refuse_other_simulator()
            recorder, controller = self.health(_RECORDER), self.health(_CONTROLLER)
            # Drive and recorder must be subscribed, so that no command is lost. Until the
            # controller knows that the drive takes trajectories, it sends speeds, which arrive
            # after t = 0.
            listeners = len(self._nodes.keys() & {"drive_sim", _RECORDER})
            return (
                self._pause_drive.service_is_ready()
                and bool(self.health("drive_sim"))
                and (
                    _RECORDER not in self._nodes
                    or (recorder.get("file", "") != "" and recorder.get("viewer state") != STARTED)
                )
                and (
                    _CONTROLLER not in self._nodes
                    or (
                        self.health("drive_sim").get("sources of commands", "0") != "0"
                        and int(controller.get("listeners", 0)) >= listeners
                        and int(controller.get("listeners to trajectories", 0)) >= 1
                        and self._start_profile.service_is_ready()
                    )
                )
            )

        if not self._spin_until(ready, _READY):
            raise AbSimError(f"the nodes did not start within {_READY:g} s; see {self._logs}")

    def start(self) -> None:
        """Start the profile, if there is one, and let the drive run."""
        if _CONTROLLER in self._nodes:
            self._call(self._start_profile, trigger_request())
            if not self._spin_until(self._profile_is_led, _ANSWER):
                raise AbSimError(f"the profile did not reach the drive; see {self._logs}")
        self._began, self._last_message = self.time, time.monotonic()
        self._call(self._pause_drive, switch_request(False))
        self._last_message = time.monotonic()

    def _profile_is_led(self) -> bool:
        """Return whether the drive has received the beginning of the profile."""
        controller, drive = self.health(_CONTROLLER), self.health("drive_sim")
        if controller.get("state", "idle") in ("idle", "waiting"):
            return False
        if controller["sends"] == "speeds":
            return True
        return drive.get(topics.TRAJECTORY_ANSWER) == topics.FOLLOWED

    def spin(self, seconds: float) -> None:
        """Process messages of the nodes for a while.

        Raises
        ------
        AbSimError
            A node has exited, or the drive has become silent.
        Interrupted
            The run was interrupted.
        """
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._listen()
        for name, process in self._processes.items():
            if process.poll() is not None:
                raise AbSimError(
                    f"{name} ended with exit code {process.returncode}:\n{self._log_of(name)}"
                )
        if self._began is not None and time.monotonic() - self._last_message > SILENCE:
            raise AbSimError(f"no message from drive_sim for {SILENCE:g} s; see {self._logs}")

    def stop_drive(self) -> dict[str, str]:
        """End the drive and its controller; the recorder remains, so that a viewer shows the run.

        Returns
        -------
        dict[str, str]
            Figures of the run, ready to print.

        Raises
        ------
        AbSimError
            A node did not exit cleanly.
        """
        self._stopping.clear()  # ends the nodes in order; another Ctrl-C ends them immediately
        wall = self._wall[1] - self._wall[0]
        factor = self.elapsed / wall if wall > 0 else math.nan
        # Publishers end first and the recorder last, so that messages in transit still arrive.
        self._end_nodes(*(name for name in self._nodes if name != _RECORDER))
        self._began = None  # messages are ignored from now on
        self._spin_until(self._all_is_recorded, _ANSWER)
        if not all(self.health(name) for name in self._nodes):
            raise AbSimError(f"a node sent no diagnostics; see {self._logs}")
        drive, recorder, controller = map(self.health, ("drive_sim", _RECORDER, _CONTROLLER))
        figures = {
            "real-time factor": f"{factor:.4f}",
            "worst lateness": f"{1e3 * float(drive['worst lateness [s]']):.2f} ms",
            "steps dropped": drive["steps dropped"],
            "commands rejected": drive["commands rejected"],
        }
        if controller:
            obeyed = int(drive["commands accepted"]) + int(drive["commands rejected"])
            figures["commands lost"] = str(int(controller["commands published"]) - obeyed)
        if recorder:
            figures["messages dropped by the recorder"] = recorder["messages dropped"]
        return figures

    def stop(self) -> None:
        """End the remaining nodes, the recorder last.

        Raises
        ------
        AbSimError
            A node did not exit cleanly.
        """
        self._stopping.clear()
        self._began = None
        self._end_nodes(*self._processes)

    def _end_nodes(self, *names: str) -> None:
        """Let nodes exit, and wait for them.

        Raises
        ------
        AbSimError
            A node did not exit in time, or with an error.
        """
        for name in names:
            self._request_exit(name)
        for name in names:
            try:
                code = self._processes[name].wait(timeout=_ANSWER)
            except subprocess.TimeoutExpired as error:
                raise AbSimError(f"{name} did not end; see {self._logs}") from error
            del self._processes[name]
            if code != 0:
                raise AbSimError(f"{name} ended with exit code {code}:\n{self._log_of(name)}")

    def _all_is_recorded(self) -> bool:
        """Return whether the recorder, if any, has the drive's last sample."""
        drive, recorder = self._health.get("/drive_sim"), self._health.get(f"/{_RECORDER}")
        return recorder is None or drive is None or recorder.time >= drive.time

    def health(self, node: str) -> dict[str, str]:
        """Return the newest diagnostics of a node; empty before its first message."""
        health = self._health.get(f"/{node}")
        return {} if health is None else health.values

    def _subscribe(self) -> None:
        """Create the node that listens to the run and calls its services."""
        self._node = rclpy.create_node("ab_sim")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._context.callback(self._leave)
        topics.JOINT_STATES.subscription(self._node, self._receive_joints)
        topics.WHIRL.subscription(self._node, self._receive_whirl)
        topics.PROFILE_STATUS.subscription(self._node, self._receive_status)
        topics.DIAGNOSTICS.subscription(self._node, self._receive_health)
        self._start_profile: Client[Any, Any] = self._node.create_client(
            Trigger, "profile_controller/start"
        )
        self._pause_drive: Client[Any, Any] = self._node.create_client(SetBool, "drive_sim/pause")

    def _receive_joints(self, message: Any) -> None:
        with contextlib.suppress(MalformedMessage):  # another robot may use this topic
            sample = topics.JOINT_STATES.sample(message)
            before, self.time = self.time, sample.time * 1e-9
            self.speed, self.ball_angles = sample.spindle_speed, sample.ball_angles
            self._last_message = time.monotonic()
            if self.time < before and self._began is not None:  # the drive was reset
                self._began, self._wall = self.time, [0.0, 0.0]
            if self._began is not None:
                self._wall[1] = self._last_message
                self._wall[0] = self._wall[0] or self._last_message - self.elapsed

    def _receive_whirl(self, message: Any) -> None:
        x, y, _ = topics.WHIRL.sample(message).place
        self.whirl = math.hypot(x, y)

    def _receive_status(self, message: Any) -> None:
        if self._began is not None:
            self.statuses.append((self.elapsed, topics.PROFILE_STATUS.sample(message)))

    def _receive_health(self, message: Any) -> None:
        for health in topics.DIAGNOSTICS.sample(message):
            self._health[health.node] = health

    def _start_processes(self) -> None:
        """Start each node in a separate process and session, with its output in a log file."""
        for name, values in self._nodes.items():
            settings = [part for k, v in values.items() for part in ("-p", f"{k}:={v}")]
            module = f"ab_sim.nodes.{name}"
            command = [sys.executable, "-c", _RUN_MODULE, module, "--ros-args", *settings]
            # In a node's first instructions, a signal would end it with a traceback.
            with (self._logs / f"{name}.log").open("wb") as log, interruption.kept_from_children():
                self._processes[name] = subprocess.Popen(
                    command,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    # Ctrl-C is for this process, which then ends the nodes in order.
                    start_new_session=True,
                    preexec_fn=_end_with_parent,
                )

    def _refuse_other_simulator(self) -> None:
        """Refuse to run if another simulator publishes the clock: nodes would follow both."""
        if topics.CLOCK.publishers(self._node) > 1:
            domain = os.environ.get("ROS_DOMAIN_ID", "0")
            raise InputError(
                f"another simulator publishes /clock on ROS_DOMAIN_ID {domain}; "
                "stop it, or use another domain: ROS_DOMAIN_ID=17 make demo"
            )

    def _listen(self) -> None:
        """Process the next message, waiting at most `GLANCE`.

        The time-out is always the same, because rclpy begins with the first subscription again
        when it changes; on a busy machine, other subscriptions would never be read.
        """
        if self._stopping.is_set():
            raise Interrupted("interrupted")
        self._executor.spin_once(timeout_sec=GLANCE)

    def _spin_until(self, condition: Callable[[], bool], deadline: float) -> bool:
        """Process messages until a condition is true; return whether it is in time [s]."""
        end = time.monotonic() + deadline
        while not condition():
            if time.monotonic() > end:
                return False
            self.spin(0.02)
        return True

    def _call(self, client: Client[Any, Any], request: Any) -> None:
        """Call a service until it succeeds.

        Raises
        ------
        AbSimError
            The service does not answer in time, or still refuses then.
        """
        service = client.srv_name
        # Nodes discover each other gradually: a request that is refused now may soon be granted.
        end = time.monotonic() + _ANSWER
        while True:
            future = client.call_async(request)
            if not self._spin_until(future.done, _ANSWER):
                raise AbSimError(f"the service {service} did not answer within {_ANSWER:g} s")
            done, text = answer_of(future.result())
            if done:
                return
            if time.monotonic() > end:
                raise AbSimError(f"the service {service} refused: {text}")
            self.spin(0.05)

    def _request_exit(self, name: str) -> None:
        """Ask a node to exit, and receive its last diagnostics."""
        process = self._processes[name]
        process.send_signal(signal.SIGINT)
        end = time.monotonic() + _ANSWER
        while (health := self._health.get(f"/{name}")) is None or health.message != ENDED:
            if process.poll() is not None and end > time.monotonic() + 0.5:
                end = time.monotonic() + 0.5  # its last message may still be in transit
            if time.monotonic() > end:
                return
            self._listen()

    def _log_of(self, name: str) -> str:
        """Return the last lines of a node's output."""
        text = (self._logs / f"{name}.log").read_text(encoding="utf-8", errors="replace")
        return "\n".join(text.splitlines()[-15:])

    def _end(self) -> None:
        """End all processes at the exit from the context, in order if possible."""
        # This does not use ROS, so it ends the nodes even if ROS fails. If this process dies
        # first, the nodes receive a signal (`_end_with_parent`).
        for process in self._processes.values():
            process.send_signal(signal.SIGINT)
        for process in self._processes.values():
            try:
                process.wait(timeout=_ANSWER)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._processes.clear()
        self._context.close()

    def _leave(self) -> None:
        """Destroy this process's node and shut ROS down."""
        if rclpy.ok():
            self._executor.shutdown()
            if leave_graph(self._node):
                rclpy.try_shutdown()
            else:
                interruption.leave_at_exit()


def _end_with_parent() -> None:
    """Let the new process receive SIGINT when the command dies, even by SIGKILL (Linux)."""
    set_parent_death_signal = 1
    ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGINT)

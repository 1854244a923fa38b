"""Real nodes in separate processes, on the test's DDS domain, watched by a real node."""

import math
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import SetBool, Trigger

from ab_msgs_py import Health, Qos, Topic, topics
from ab_msgs_py.services import Answer, answer_of, switch_request, trigger_request
from ab_msgs_py.topic import arrived
from tests.forked.node import ForkedNode

Process = subprocess.Popen[bytes] | ForkedNode
DEADLINE = 120.0
"""Deadline of a wait [s], with time for a node to compile its kernel first."""
ACQUAINTED = 0.5
"""Time for a discovered server to discover this process as well [s].

If it does not within 0.1 s of a request, as on a busy machine, Fast DDS drops the answer.
"""
SERVICES: dict[str, dict[str, Any]] = {
    "drive_sim": {
        "pause": SetBool,
        "reset": Trigger,
        "set_parameters_atomically": SetParametersAtomically,
        "step": Trigger,
    },
    "profile_controller": {"abort": Trigger, "start": Trigger},
}
"""Services that many tests call; their clients are discovered while the nodes start."""
GLANCE = 0.05
"""Longest wait for a message, and time between two checks of processes and clients [s]."""
EACH_CHANGE = Qos(100, latched=True)
"""Quality of service for latched topics, so that a busy test receives each change."""


class Fleet:
    """Nodes that are started, watched and stopped; every wait has a condition and a deadline."""

    def __init__(self, domain: int, logs: Path) -> None:
        self.environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "PYTHONUNBUFFERED": "1",
        }
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        self._logs = logs
        self.processes: dict[str, Process] = {}
        self.heard: dict[str, list[Any]] = {}
        self.healths: list[Health] = []
        """Health reports of all nodes, oldest first."""
        self._context = rclpy.Context()
        rclpy.init(
            context=self._context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        # Services of the watcher would cost time in each wait, and in each node's discovery.
        self.node = rclpy.create_node(
            "watcher",
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter("start_type_description_service", value=False)],
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.publishers: dict[str, Any] = {}
        self._clients: dict[str, Any] = {}
        """Clients by service."""
        self._ready: dict[str, float] = {}
        """Times at which clients were first ready, by service."""
        self._looked = 0.0
        topics.DIAGNOSTICS.subscription(
            self.node, lambda message: self.healths.extend(Health.all_of(message))
        )

    def listen(self, topic: Topic) -> list[Any]:
        """Subscribe to a topic; return the growing list of its messages."""
        heard = self.heard.setdefault(topic.name, [])
        if topic.qos.latched:
            topic = topic._replace(qos=EACH_CHANGE)
        topic.subscription(self.node, heard.append)
        return heard

    def start(self, node: str, module: str = "", *words: str, **parameters: Any) -> Process:
        """Start a node in a forked process.

        The nodes of `ab-sim demo` and `live`, and installed scripts, have separate processes.

        Parameters
        ----------
        node
            Name; ``left/drive_sim`` in a namespace, with a clock there.
        module
            Module whose ``main`` is the node; default: that of ``ab_sim.nodes``.
        words
            Arguments before those of ROS.
        parameters
            Parameters of the node.
        """
        settings = [part for k, v in parameters.items() for part in ("-p", f"{k}:={v}")]
        namespace, _, executable = node.rpartition("/")
        if namespace:
            settings += ["-r", f"__ns:=/{namespace}", "-r", "/clock:=clock"]
        self._forget_services(node)
        self.processes[node] = ForkedNode(
            module or f"ab_sim.nodes.{executable}",
            [*words, "--ros-args", *settings],
            self.environment,
            self._log_file(node),
        )
        for service, kind in SERVICES.get(executable, {}).items():
            self.meet(kind, f"{node}/{service}")
        return self.processes[node]

    def start_process(self, name: str, *command: str | Path) -> Process:
        """Start any program on the fleet's domain; it is watched and stopped like a node."""
        self._forget_services(name)
        with self._log_file(name).open("wb") as log:
            self.processes[name] = subprocess.Popen(
                command, env=self.environment, stdout=log, stderr=subprocess.STDOUT
            )
        return self.processes[name]

    def log(self, node: str) -> str:
        """Return the output of a node so far."""
        return self._log_file(node).read_text()

    def reads(self, node: str, words: str) -> None:
        """Wait for a text in a node's output, which may come a moment after a message."""
        self.until(lambda: words in self.log(node), f"{node} prints {words!r}")

    def until(self, condition: Callable[[], Any], what: str, deadline: float = DEADLINE) -> Any:
        """Listen until a condition is true; return its value.

        The condition is evaluated after all messages that have arrived are processed. Fast DDS
        delivers the messages of one process in the order of publication. A message or an answer
        for which a test has waited thus comes after everything that its sender published before.
        """
        end = time.monotonic() + deadline
        while True:
            self._catch_up()
            if value := condition():
                return value
            assert (now := time.monotonic()) < end, (
                f"not within {deadline} s: {what}; {self._tails()}"
            )
            if now - self._looked > GLANCE:
                self._looked = now
                dead = {n: c for n, p in self.processes.items() if (c := p.poll())}
                assert not dead, f"died with exit codes {dead}: {what}; {self._tails()}"
                self._look_at_clients()
            self._executor.spin_once(timeout_sec=GLANCE)

    def health(self, node: str) -> Health | None:
        """Return the newest health report of a node; None before the first."""
        return next((each for each in reversed(self.healths) if each.node == f"/{node}"), None)

    def healths_of(self, node: str) -> list[Health]:
        """Return all health reports of a node, oldest first.

        They show a value that a node reports only for a moment.
        """
        return [each for each in self.healths if each.node == f"/{node}"]

    def value(self, node: str, key: str) -> str:
        """Return a value of a node's newest health report; empty before the first."""
        health = self.health(node)
        return "" if health is None else health.values.get(key, "")

    def call(self, service: str, switch: bool | None = None, again: float = math.inf) -> Answer:
        """Call a Trigger service, or with ``switch`` a SetBool service; see ``ask``."""
        kind = Trigger if switch is None else SetBool
        request = trigger_request() if switch is None else switch_request(switch)
        return answer_of(self.ask(kind, service, request, again))

    def set(self, node: str, **values: Any) -> Answer:
        """Set all parameters or none; return success and the reason of a failure."""
        request = SetParametersAtomically.Request(
            parameters=[Parameter(name, value=v).to_parameter_msg() for name, v in values.items()]
        )
        service = f"{node}/set_parameters_atomically"
        result = self.ask(SetParametersAtomically, service, request).result
        return bool(result.successful), str(result.reason)

    def change(self, node: str, transition: str) -> bool:
        """Request a transition of a lifecycle node; return whether it succeeded."""
        request = ChangeState.Request(transition=Transition(label=transition))
        return bool(self.ask(ChangeState, f"{node}/change_state", request).success)

    def state(self, node: str) -> str:
        """Return the state of a lifecycle node."""
        answer = self.ask(GetState, f"{node}/get_state", GetState.Request())
        return str(answer.current_state.label)

    def ask(self, kind: Any, service: str, request: Any, again: float = math.inf) -> Any:
        """Call a service of any type, every ``again`` seconds, and return its first response."""
        client, futures, sent = self.client(kind, service), [], -math.inf

        def answer() -> Any:
            nonlocal client, sent
            if time.monotonic() - sent > again or not futures:
                futures.append(client.call_async(request))
                sent = time.monotonic()
                if again < math.inf:
                    # A client that knew a killed server may never reach the server after it. The
                    # next call is by a client that has had this time to discover the server.
                    client = self.node.create_client(kind, service)
            return next((future for future in futures if future.done()), None)

        return self.until(answer, f"answer of {service}").result()

    def client(self, kind: Any, service: str) -> Any:
        """Return a client of a service, after client and server have discovered each other."""
        self.meet(kind, service)
        self.until(lambda: self._is_acquainted(service), f"service {service}")
        return self._clients[service]

    def meet(self, kind: Any, service: str) -> None:
        """Create the client of a service, so that its discovery by the server begins."""
        if service not in self._clients:
            self._clients[service] = self.node.create_client(kind, service)

    def _look_at_clients(self) -> None:
        for service in self._clients.keys() - self._ready.keys():
            if self._clients[service].service_is_ready():
                self._ready[service] = time.monotonic()

    def _is_acquainted(self, service: str) -> bool:
        self._look_at_clients()
        return time.monotonic() - self._ready.get(service, math.inf) > ACQUAINTED

    def _forget_services(self, node: str) -> None:
        """Destroy the clients of a node that starts or stops, because its services are replaced."""
        for service in [s for s in self._clients if s.startswith(f"{node}/")]:
            self.node.destroy_client(self._clients.pop(service))
            self._ready.pop(service, None)

    def acquainted(self) -> None:
        """Wait until a server that this process knows has discovered this process, too."""
        known = time.monotonic() + ACQUAINTED
        self.until(lambda: time.monotonic() > known, "the server knows its client")

    def command(self, *speeds: float) -> None:
        """Publish speed commands to a drive that listens [rad/s]."""
        self.publish(topics.COMMAND, *map(topics.COMMAND.message, speeds))

    def publish(self, topic: Topic, *messages: Any) -> None:
        """Publish messages on a topic of commands to a drive that listens."""
        if topic.name not in self.publishers:
            self.publishers[topic.name] = topic.publisher(self.node)
        publisher = self.publishers[topic.name]
        self.until(lambda: self._all_hear(publisher), f"the drive listens to {topic.name}")
        for message in messages:
            publisher.publish(message)

    def _all_hear(self, publisher: Any) -> bool:
        """Return whether a drive subscribes, and whether all known subscribers are matched."""
        known = self.node.get_subscriptions_info_by_topic(publisher.topic_name)
        drives = [each for each in known if each.node_name == "drive_sim"]
        return bool(drives) and publisher.get_subscription_count() >= len(known)

    def stop(self, node: str, number: int = signal.SIGINT) -> int:
        """Send a signal to a node and wait for its exit; return the exit code."""
        self.processes[node].send_signal(number)
        return self._end_of(node, f"{node} ends")

    def ended(self, node: str) -> int:
        """Wait until a node exits by itself; return the exit code."""
        return self._end_of(node, f"{node} ends by itself")

    def _end_of(self, node: str, what: str) -> int:
        process = self.processes.pop(node)  # it may end with any code
        self._forget_services(node)
        try:
            self.until(lambda: process.poll() is not None, what)
        finally:
            process.kill()
        heard = time.monotonic() + 0.2
        self.until(lambda: time.monotonic() > heard, "what it said last is heard")
        return process.wait()

    def _catch_up(self) -> None:
        """Process all messages that have arrived while a busy machine delayed this process."""
        for subscription in self.node.subscriptions:
            for message, *_ in arrived(subscription, subscription.qos_profile.depth):
                subscription.callback(message)

    def close(self) -> None:
        """Stop the remaining nodes."""
        for process in self.processes.values():
            process.kill()
            process.wait()
        # Fast DDS has crashed where a participant went while it was still hearing of others' ends.
        time.sleep(0.3)
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    def _log_file(self, node: str) -> Path:
        return self._logs / f"{node.replace('/', '-')}.log"

    def _tails(self) -> str:
        return "".join(f"\n--- {n}:\n{self.log(n)[-800:]}" for n in self.processes)

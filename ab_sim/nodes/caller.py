"""Client of a node's services in another process; errors list the available nodes and services."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import rclpy
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters, ListParameters, SetParametersAtomically
from rclpy.client import Client
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python

from ab_msgs_py import Health, topics
from ab_sim.base import interruption
from ab_sim.base.errors import AbSimError, InputError, Interrupted, Refused, nearest
from ab_sim.model.spindle import SpeedServo
from ab_sim.nodes.discovery import DISCOVERY_RANGE, participants_here
from ab_sim.nodes.process import completes, init_ros
from ab_sim.nodes.session import INACTIVE

_ACQUAINTED = 0.5
"""Time for mutual discovery [s]. A server that this node has discovered may not have discovered
this node. If it does not within 0.1 s of a request, as on a busy machine, Fast DDS drops the
answer."""
_ANSWER = 10.0
"""Longest time for the answer of a service that does no long work [s]."""
GLANCE = 0.05
"""Longest wait for the next message [s]."""
PARAMETERS = {
    "list_parameters": ListParameters,
    "get_parameters": GetParameters,
    "set_parameters_atomically": SetParametersAtomically,
}
"""Types of the services for parameters, by name."""


class Caller:
    """Service client with its own node; a context manager in which Ctrl-C raises Interrupted.

    Parameters
    ----------
    timeout
        Longest time to wait for the discovery of a node [s].
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._context = contextlib.ExitStack()
        self._clients: dict[str, Client[Any, Any]] = {}

    def __enter__(self) -> Caller:
        self._stopping = self._context.enter_context(interruption.in_order())
        init_ros(["ab-sim"])
        # ROS tools hide names with a leading underscore. With the process id, the names of several
        # callers differ.
        self.node = rclpy.create_node(
            f"_ab_sim_{os.getpid()}", enable_rosout=False, start_parameter_services=False
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        if completes(self.node.destroy_node):
            rclpy.try_shutdown()
        else:
            interruption.leave_at_exit()
        self._context.close()

    def wait_for_services(
        self, node: str, services: Mapping[str, Any], urgent: bool = False
    ) -> None:
        """Wait until a node offers services, and discovery is mutual.

        Parameters
        ----------
        node
            Full name of the node.
        services
            Types of the services to call, by name.
        urgent
            Whether to omit mutual discovery. Requests must then be repeated, and all nodes that
            offer the service are called.

        Raises
        ------
        InputError
            No node offers a service in time, or several do; the message lists the available nodes
            and services.
        """
        for name, kind in services.items():
            self._clients[name] = self.node.create_client(kind, f"{node}/{name}")
        clients = self._clients.values()
        if not self.wait_until(lambda: all(c.service_is_ready() for c in clients), self._timeout):
            missing = [n for n, client in self._clients.items() if not client.service_is_ready()]
            raise InputError(self._not_offered_text(node, missing[0]))
        if urgent:
            return
        self.wait_until(lambda: False, _ACQUAINTED)  # long enough to discover a second server, too
        for name in services:
            if (count := self.node.count_services(f"{node}/{name}")) > 1:
                raise InputError(
                    f"{count} nodes offer {node}/{name}; end all but one, or give them namespaces"
                )

    def call(self, service: str, request: Any, timeout: float = _ANSWER, again: float = 0.0) -> Any:
        """Call a service, which ``wait_for_services`` has found, and return the answer.

        Parameters
        ----------
        service
            Name of the service.
        request
            Request message.
        timeout
            Longest time to wait for the answer [s].
        again
            Time after which the request is repeated [s]; 0: never.

        Raises
        ------
        AbSimError
            There was no answer within ``timeout``.
        """
        client, end = self._clients[service], time.monotonic() + timeout
        while True:
            future = client.call_async(request)
            remaining = end - time.monotonic()
            if self.wait_until(future.done, min(again, remaining) if again else remaining):
                return future.result()
            if time.monotonic() >= end:
                raise AbSimError(
                    f"{client.srv_name} did not answer within {timeout:g} s; it may be busy and "
                    "execute the request later"
                )

    def parameters(self, names: Sequence[str] = ()) -> dict[str, Any]:
        """Return the values of a node's parameters by name; without names, those of all.

        Raises
        ------
        InputError
            The node has no parameter of a name; the message has the nearest name.
        """
        all_names = sorted(self.call("list_parameters", ListParameters.Request()).result.names)
        for name in names:
            if name not in all_names:
                own_names = [other for other in all_names if "." not in other]
                raise InputError(
                    f"{name}: the node has no such parameter{nearest(name, all_names)}; it has "
                    + ", ".join(own_names)
                )
        wanted = list(names) or all_names
        answer = self.call("get_parameters", GetParameters.Request(names=wanted))
        pairs = zip(wanted, answer.values, strict=False)
        return {name: _plain(parameter_value_to_python(value)) for name, value in pairs}

    def set(self, values: Mapping[str, Any]) -> None:
        """Set parameters of the node; if one is refused, none is set.

        Raises
        ------
        InputError
            The node has no such parameter, or a value is of no parameter type.
        Refused
            The node rejects the values; the message states the reason.
        """
        self.parameters([*values])
        messages = [_message(name, value) for name, value in values.items()]
        request = SetParametersAtomically.Request(parameters=messages)
        result = self.call("set_parameters_atomically", request).result
        if not result.successful:
            raise Refused(result.reason or f"refused: {', '.join(values)}")

    def clear_interrupt(self) -> None:
        """Allow further calls after Ctrl-C, to restore parameters."""
        self._stopping.clear()

    def nodes(self) -> dict[str, list[str]]:
        """Return the discovered nodes with the names of their services."""
        nodes: dict[str, list[str]] = {}
        for name, namespace in self.node.get_node_names_and_namespaces():
            if name.startswith("_"):
                continue
            whole = f"{namespace.rstrip('/')}/{name}"
            # The node may have exited since it was listed.
            with contextlib.suppress(Exception):
                offers = self.node.get_service_names_and_types_by_node(name, namespace)
                mine = [service.removeprefix(f"{whole}/") for service, _ in offers]
                nodes[whole] = sorted(service for service in mine if "/" not in service)
        return nodes

    def collect_health(self) -> dict[str, Health]:
        """Collect the newest diagnostics of all nodes, by full name.

        Collection ends when all nodes on this machine have been discovered, and the diagnostics of
        each have arrived. If the number of nodes is unknown, it ends after the time-out.
        """
        received: dict[str, Health] = {}

        def receive(message: Any) -> None:
            for health in topics.DIAGNOSTICS.sample(message):
                received[health.node] = health

        topics.DIAGNOSTICS.subscription(self.node, receive)

        def all_received() -> bool:
            return self._all_discovered() and all(
                name in received for name in self._diagnostics_publishers()
            )

        end = time.monotonic() + self._timeout
        # Besides this process, there are other participants; their topics are discovered later.
        if participants_here() != 1:
            self.wait_until(all_received, self._timeout)
            self._await_services(end)
            self.wait_until(all_received, end - time.monotonic())
        return received

    def _await_services(self, end: float) -> None:
        """Wait until ``_ACQUAINTED`` has passed without a new service, at most until ``end`` [s].

        A node's diagnostics may arrive before all of its services have been discovered.
        """
        discovered = None
        while discovered is None or (discovered != self.nodes() and time.monotonic() < end):
            discovered = self.nodes()
            self.wait_until(lambda: False, _ACQUAINTED)

    def _all_discovered(self) -> bool:
        """Return whether as many nodes are discovered as this machine has DDS participants."""
        there = participants_here()
        return there is not None and len(self.node.get_node_names()) >= there

    def _diagnostics_publishers(self) -> list[str]:
        """Return the full names of the nodes that publish diagnostics."""
        publishers = self.node.get_publishers_info_by_topic(topics.DIAGNOSTICS.name)
        return [f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in publishers]

    @property
    def no_nodes_text(self) -> str:
        """Message for the case that no node was found."""
        domain, reach = os.environ.get("ROS_DOMAIN_ID", "0"), os.environ.get(DISCOVERY_RANGE, "")
        return f"there is no node at all on ROS_DOMAIN_ID {domain}, {DISCOVERY_RANGE} {reach}"

    def _not_offered_text(self, node: str, service: str) -> str:
        """Return the error for a service that a node lacks, with the nodes and services found."""
        nodes = self.nodes()
        text = f"no node offers {node}/{service} (waited {self._timeout:g} s); "
        if not nodes:
            return text + f"{self.no_nodes_text}: is it running?"
        if node in nodes:
            return text + f"{node} is running, and offers " + ", ".join(_specific(nodes[node]))
        # Every node has the services for parameters, so that naming those nodes would not help.
        is_common = service in PARAMETERS
        able = [name for name, offers in nodes.items() if service in offers and not is_common]
        if able:
            return text + f"{', '.join(able)} offers it: choose with --namespace and --node"
        return text + f"found {', '.join(nodes)}; choose one with --namespace and --node"

    def wait_until(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Process messages until a condition is true; return whether it is in time [s]."""
        end = time.monotonic() + seconds
        while not condition():
            if self._stopping.is_set():
                raise Interrupted("interrupted")
            if time.monotonic() >= end:
                return False
            # If the time-out changed, rclpy would begin again with the first subscription, and on a
            # busy machine never read the others.
            self._executor.spin_once(timeout_sec=GLANCE)
        return True


def _specific(services: Iterable[str]) -> list[str]:
    """Return the services without those that every ROS node has, such as for parameters."""
    common = ("parameter", "type_description")
    return [name for name in services if not any(word in name for word in common)] or ["nothing"]


def _plain(value: Any) -> Any:
    """Return a parameter's value with Python's list for arrays."""
    return value if isinstance(value, (bool, int, float, str, type(None))) else list(value)


def _message(name: str, value: Any) -> Any:
    """Return the message that sets a parameter.

    Raises
    ------
    InputError
        ROS has no parameter type for the value.
    """
    try:
        message = Parameter(name, value=value).to_parameter_msg()
    except Exception as error:
        # rclpy raises a different class for each kind of invalid value.
        raise InputError(f"{name}={value!r}: is not a possible value of a parameter") from error
    if message.value.type == ParameterType.PARAMETER_NOT_SET:
        raise InputError(f"{name}=: a value is missing; an empty text is {name}=\"''\"")
    return message


_COUNTS = ("commands accepted", "commands rejected", "commands ignored")
"""Counts in a drive's diagnostics, by which the reaction to a command is recognised."""
_ROUNDED = 1.0 + 1e-5
"""Factor on the speed limit, because diagnostics report it with six digits only; up to the enlarged
limit the drive decides."""

_SPEED_WAIT = 1.0
"""Longest time to wait for the drive's present speed [s], which is part of the answer."""


class AcceptedSpeed(NamedTuple):
    """Command that the drive has accepted."""

    before: float | None
    """Spindle speed before the command [rad/s]; None if the drive publishes none."""
    limits: SpeedServo
    """Limits of the drive's commands."""
    health: Health
    """Diagnostics of the drive after the command."""

    @property
    def standing(self) -> bool:
        """True if the drive's time is paused."""
        return self.health.message.startswith("paused")

    @property
    def other_sources(self) -> int:
        """Number of other nodes that publish commands."""
        return max(int(self.health.values["sources of commands"]) - 1, 0)


class SpeedCaller(Caller):
    """Service client that can also command a speed."""

    def command(self, node: str, speed: float) -> AcceptedSpeed:
        """Publish a speed command when a drive subscribes, and wait for the drive's reaction.

        Parameters
        ----------
        node
            Full name of the drive's node.
        speed
            Target speed of the spindle [rad/s].

        Raises
        ------
        InputError
            The drive does not exist.
        CommandError
            The speed exceeds the drive's limit.
        Refused
            The drive does not subscribe to commands, or ignores them.
        AbSimError
            The drive does not report the command.
        """
        healths: list[Health] = []
        speeds: list[float] = []

        def receive(message: Any) -> None:
            healths.extend(h for h in topics.DIAGNOSTICS.sample(message) if h.node == node)

        namespace = node.rpartition("/")[0]
        topic, joints = (
            topic._replace(name=topic.within(namespace))
            for topic in (topics.COMMAND, topics.JOINT_STATES)
        )
        topics.DIAGNOSTICS.subscription(self.node, receive)
        joints.subscription(
            self.node, lambda message: speeds.append(joints.sample(message).spindle_speed)
        )
        publisher = topic.publisher(self.node)

        if not self.wait_until(lambda: healths and _counts(healths[-1]), self._timeout):
            raise InputError(self._no_drive_text(node, healths))
        if healths[-1].message == INACTIVE:
            raise Refused(f"{node}: {INACTIVE}; nothing was commanded")
        if not self.wait_until(publisher.get_subscription_count, self._timeout):
            raise Refused(f"{node} does not subscribe to {topic.name} (waited {self._timeout:g} s)")
        limits = _limits(healths[-1])
        if abs(speed) > limits.max_speed * _ROUNDED:
            limits.check(speed)
        if healths[-1].values["speed set by"] == "emergency stop":
            raise Refused(
                f"{node}: commands are ignored after an emergency stop, until reset-emergency-stop"
            )
        # A drive whose time is paused publishes no speed.
        self.wait_until(lambda: speeds, _SPEED_WAIT)
        before, seen = _counts(healths[-1]), len(healths)
        standing_at = speeds[-1] if speeds else None
        publisher.publish(topic.message(speed))
        publisher.wait_for_all_acked(Duration(seconds=_ANSWER))
        if not self.wait_until(
            lambda: len(healths) > seen and _counts(healths[-1]) != before, _ANSWER
        ):
            raise AbSimError(f"{node} did not report the command within {_ANSWER:g} s")
        health = healths[-1]
        accepted, *others = (now - then for now, then in zip(_counts(health), before, strict=True))
        if not accepted and any(others):
            raise Refused(f"{node} has not followed the command: {health.message}")
        return AcceptedSpeed(standing_at, _limits(health), health)

    def _no_drive_text(self, node: str, healths: list[Health]) -> str:
        """Return the error for a node that has not reported as a drive."""
        if healths:
            return f"{node} accepts no commands; its message is: {healths[-1].message}"
        nodes = self.nodes()
        there = f"found {', '.join(sorted(nodes))}" if nodes else self.no_nodes_text
        return (
            f"there is no drive {node} (waited {self._timeout:g} s); {there}; start one, or choose "
            "another with --namespace and --node"
        )


def _counts(health: Health) -> tuple[int, ...]:
    """Return the numbers of accepted, rejected and ignored commands; empty if not reported."""
    return tuple(int(health.values[key]) for key in _COUNTS if key in health.values)


def _limits(health: Health) -> SpeedServo:
    """Return the limits of commands from a drive's diagnostics."""
    speed, acceleration = (
        float(health.values[key]) for key in ("speed limit [rad/s]", "acceleration limit [rad/s^2]")
    )
    return SpeedServo(speed, acceleration)

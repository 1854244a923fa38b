"""Calls the services of a node that runs elsewhere, and says what there is if it is not there."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import TracebackType
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters, ListParameters, SetParametersAtomically
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python

from ab_msgs_py import Health, topics
from ab_sim import interruption
from ab_sim.errors import AbSimError, InputError, Interrupted, Refused, nearest
from ab_sim.nodes.arguments import init_ros
from ab_sim.nodes.discovery import DISCOVERY_RANGE
from ab_sim.nodes.participants import participants_here

ACQUAINTED = 0.5
"""s. That a server is there says that we know it. If it does not know us within 0.1 s of a request,
as on a busy machine, Fast DDS drops the answer."""
ANSWER = 10.0
"""s for an answer that takes no work."""
PARAMETERS = {
    "list_parameters": ListParameters,
    "get_parameters": GetParameters,
    "set_parameters_atomically": SetParametersAtomically,
}


class Caller:
    """Somebody on the network who asks: use it as a context, in which Ctrl-C raises Interrupted.

    Args:
        timeout: s to wait for a node to be found.
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._context = contextlib.ExitStack()
        self._clients: dict[str, Client[Any, Any]] = {}

    def __enter__(self) -> Caller:
        self._stopping = self._context.enter_context(interruption.in_order())
        init_ros(["ab-sim"])
        # By ROS's convention a name with an underscore in front is not shown; and two may call.
        self._node = rclpy.create_node(
            f"_ab_sim_{os.getpid()}", enable_rosout=False, start_parameter_services=False
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()
        self._context.close()

    def wait_for_services(
        self, node: str, services: Mapping[str, Any], urgent: bool = False
    ) -> None:
        """Wait until a node offers services, and discovery is mutual.

        Args:
            node: its full name.
            services: to be called: type by name.
            urgent: do not wait for mutual discovery, so that requests have to be repeated; if
                several nodes offer a service, all are called.

        Raises:
            InputError: a service is not offered in time, or by several nodes; lists what there is.
        """
        for name, kind in services.items():
            self._clients[name] = self._node.create_client(kind, f"{node}/{name}")
        clients = self._clients.values()
        if not self._until(lambda: all(c.service_is_ready() for c in clients), self._timeout):
            missing = [n for n, client in self._clients.items() if not client.service_is_ready()]
            raise InputError(self._not_offered_text(node, missing[0]))
        if urgent:
            return
        self._until(lambda: False, ACQUAINTED)  # in which a second one is discovered, too
        for name in services:
            if (count := self._node.count_services(f"{node}/{name}")) > 1:
                raise InputError(
                    f"{count} nodes offer {node}/{name}; end all but one, or give them namespaces"
                )

    def call(self, service: str, request: Any, timeout: float = ANSWER, again: float = 0.0) -> Any:
        """The answer of a service that ``wait_for_services`` has found.

        Args:
            service: its name.
            request: for it.
            timeout: s to wait for the answer.
            again: s after which the request is repeated; 0: it is not.

        Raises:
            AbSimError: there is no answer in time.
        """
        client, end = self._clients[service], time.monotonic() + timeout
        while True:
            future = client.call_async(request)
            left = end - time.monotonic()
            if self._until(future.done, min(again, left) if again else left):
                return future.result()
            if time.monotonic() >= end:
                raise AbSimError(
                    f"{client.srv_name} did not answer within {timeout:g} s; it may be busy, and "
                    "do what it was asked for all the same"
                )

    def parameters(self, names: Sequence[str] = ()) -> dict[str, Any]:
        """The values of a node's parameters, of all of them if none is named.

        Raises:
            InputError: it has none of such a name; gives the nearest.
        """
        known = sorted(self.call("list_parameters", ListParameters.Request()).result.names)
        for name in names:
            if name not in known:
                own = [other for other in known if "." not in other]
                raise InputError(
                    f"{name}: the node has no such parameter{nearest(name, known)}; it has "
                    + ", ".join(own)
                )
        wanted = list(names) or known
        answer = self.call("get_parameters", GetParameters.Request(names=wanted))
        pairs = zip(wanted, answer.values, strict=False)
        return {name: _plain(parameter_value_to_python(value)) for name, value in pairs}

    def set(self, values: Mapping[str, Any]) -> None:
        """Set parameters of the node, all or none.

        Raises:
            InputError: it has none of such a name, or a value is none that a parameter may have.
            Refused: the node does not want them; says why.
        """
        self.parameters([*values])
        each = [_message(name, value) for name, value in values.items()]
        request = SetParametersAtomically.Request(parameters=each)
        result = self.call("set_parameters_atomically", request).result
        if not result.successful:
            raise Refused(result.reason or f"refused: {', '.join(values)}")

    def clear_interrupt(self) -> None:
        """Allow further calls after Ctrl-C, to restore parameters."""
        self._stopping.clear()

    def nodes(self) -> dict[str, list[str]]:
        """The discovered nodes, with the names of their services."""
        nodes: dict[str, list[str]] = {}
        for name, namespace in self._node.get_node_names_and_namespaces():
            if name.startswith("_"):
                continue
            whole = f"{namespace.rstrip('/')}/{name}"
            # A node may be gone by now.
            with contextlib.suppress(Exception):
                offers = self._node.get_service_names_and_types_by_node(name, namespace)
                mine = [service.removeprefix(f"{whole}/") for service, _ in offers]
                nodes[whole] = sorted(service for service in mine if "/" not in service)
        return nodes

    def collect_health(self) -> dict[str, Health]:
        """Diagnostics of the nodes, by full name.

        It ends when all nodes on this machine were discovered and all that publish diagnostics
        were received; if that cannot be known, after the time to wait for a node.
        """
        received: dict[str, Health] = {}

        def receive(message: Any) -> None:
            for health in topics.DIAGNOSTICS.sample(message):
                received[health.node] = health

        topics.DIAGNOSTICS.subscription(self._node, receive)

        def all_received() -> bool:
            return self._all_discovered() and all(
                name in received for name in self._diagnostics_publishers()
            )

        end = time.monotonic() + self._timeout
        if participants_here() != 1:  # Not alone: what others offer is found after they are.
            self._until(all_received, self._timeout)
            self._until(lambda: False, ACQUAINTED)
            self._until(all_received, end - time.monotonic())
        return received

    def _all_discovered(self) -> bool:
        """Whether as many nodes as DDS participants were discovered, this process included."""
        there = participants_here()
        return there is not None and len(self._node.get_node_names()) >= there

    def _diagnostics_publishers(self) -> list[str]:
        """Full names of the nodes that publish diagnostics."""
        publishers = self._node.get_publishers_info_by_topic(topics.DIAGNOSTICS.name)
        return [f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in publishers]

    @property
    def no_nodes_text(self) -> str:
        """Text for the case that no node was found."""
        domain, reach = os.environ.get("ROS_DOMAIN_ID", "0"), os.environ.get(DISCOVERY_RANGE, "")
        return f"there is no node at all on ROS_DOMAIN_ID {domain}, {DISCOVERY_RANGE} {reach}"

    def _not_offered_text(self, node: str, service: str) -> str:
        found = self.nodes()
        said = f"nobody offers {node}/{service} (waited {self._timeout:g} s); "
        if not found:
            return said + f"{self.no_nodes_text}: is it running?"
        if node in found:
            return said + f"{node} is there, and offers " + ", ".join(_own(found[node]))
        asked = service in PARAMETERS
        able = [name for name, offers in found.items() if service in offers and not asked]
        if able:
            return said + f"{', '.join(able)} would: --namespace and --node say whom you mean"
        return said + f"found {', '.join(found)}; --namespace and --node say whom you mean"

    def _until(self, condition: Callable[[], Any], seconds: float) -> bool:
        end = time.monotonic() + seconds
        while not condition():
            if self._stopping.is_set():
                raise Interrupted("interrupted")
            if (left := end - time.monotonic()) <= 0:
                return False
            self._executor.spin_once(timeout_sec=min(left, 0.05))
        return True


def _own(services: Iterable[str]) -> list[str]:
    """Without those that every node has for its parameters."""
    common = ("parameter", "type_description")
    return [name for name in services if not any(word in name for word in common)] or ["nothing"]


def _plain(value: Any) -> Any:
    return value if isinstance(value, (bool, int, float, str, type(None))) else list(value)


def _message(name: str, value: Any) -> Any:
    try:
        message = Parameter(name, value=value).to_parameter_msg()
    except Exception as error:
        # rclpy raises a different class for every way in which a value can be none.
        raise InputError(f"{name}={value!r}: is no value that a parameter may have") from error
    if message.value.type == ParameterType.PARAMETER_NOT_SET:
        raise InputError(f"{name}=: a value is missing; an empty text is {name}=\"''\"")
    return message

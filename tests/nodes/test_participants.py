"""How many participants this machine has: real ones, on a domain of their own."""

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

import rclpy  # noqa: E402
from rclpy.context import Context  # noqa: E402

from ab_sim.nodes.discovery import DISCOVERY_RANGE, RANGE  # noqa: E402
from ab_sim.nodes.participants import participants_here  # noqa: E402
from tests.domains import own_domain  # noqa: E402

pytestmark = pytest.mark.ros


def test_each_counts_from_its_first_node_on(monkeypatch: pytest.MonkeyPatch) -> None:
    with own_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        monkeypatch.setenv(DISCOVERY_RANGE, RANGE)
        monkeypatch.delenv("ROS_STATIC_PEERS", raising=False)
        assert participants_here() == 0
        contexts, nodes = [Context(), Context()], []
        for number, context in enumerate(contexts, start=1):
            rclpy.init(context=context, args=[])
            nodes += [rclpy.create_node(name, context=context) for name in ("one", "two")]
            assert participants_here() == number
        monkeypatch.setenv("ROS_STATIC_PEERS", "192.0.2.1")
        assert participants_here() is None, "others may be elsewhere"
        monkeypatch.delenv("ROS_STATIC_PEERS")
        monkeypatch.setenv(DISCOVERY_RANGE, "SUBNET")
        assert participants_here() is None
        for node in nodes:
            node.destroy_node()
        for context in contexts:
            context.try_shutdown()

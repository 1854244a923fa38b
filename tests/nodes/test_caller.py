"""Waits of the client of a node's services."""

import pytest
import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64

from ab_sim.nodes.caller import Caller
from tests.waiting import PATIENCE

pytestmark = pytest.mark.ros

FLOOD = 200


def test_a_flood_of_one_topic_does_not_hold_back_another(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An executor begins again with its first subscription whenever its time-out is another."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("speaker", context=context)
    depth = QoSProfile(depth=2 * FLOOD)
    flood, lone = (node.create_publisher(Float64, name, depth) for name in ("flood", "lone"))
    flooded: list[float] = []
    heard: list[float] = []
    try:
        with Caller(PATIENCE) as caller:
            for name, received in (("flood", flooded), ("lone", heard)):
                caller.node.create_subscription(
                    Float64, name, lambda m, to=received: to.append(m.data), depth
                )
            assert caller.wait_until(
                lambda: flood.get_subscription_count() == lone.get_subscription_count() == 1,
                PATIENCE,
            )
            for _ in range(FLOOD):
                flood.publish(Float64())
            lone.publish(Float64())
            # Acknowledged messages wait to be read, so that no timing decides what is read first.
            for publisher in (flood, lone):
                assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE))
            while not heard and len(flooded) < FLOOD:
                caller.wait_until(lambda: bool(heard), 0.02)
            assert heard and len(flooded) < FLOOD // 2
    finally:
        rclpy.shutdown(context=context)

"""Who ends is seen to have gone."""

import sys
import threading
from types import SimpleNamespace

import pytest
import rclpy
from rclpy.signals import SignalHandlerOptions

from ab_sim.nodes import process
from tests.nodes.fleet import Fleet
from tests.waiting import PATIENCE

pytestmark = pytest.mark.ros


def test_a_participant_goes_after_others_know_that_its_node_has_gone(
    fleet: Fleet, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else they may take in its last words after its end, and show the node for ever."""
    known = threading.Event()
    waits = SimpleNamespace(sleep=lambda _: known.wait(PATIENCE))
    monkeypatch.setattr(process, "time", waits)
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("brief", context=context)
    fleet.until(lambda: "brief" in fleet.node.get_node_names(), "it is there")
    ends = threading.Thread(target=process.leave_graph, args=[node, PATIENCE])
    ends.start()
    try:
        others = fleet.until(
            lambda: "brief" not in (n := fleet.node.get_node_names()) and n, "it has gone"
        )
        assert ends.is_alive()
        (last,) = set(others) - {"watcher"}
        assert last.startswith("_"), "its participant is there, with what nobody is shown"
    finally:
        known.set()
        ends.join()
    fleet.until(lambda: fleet.node.get_node_names() == ["watcher"], "its participant leaves")
    rclpy.shutdown(context=context)


def test_a_node_ends_where_fast_dds_waits_for_itself(fleet: Fleet) -> None:
    program = (
        "import threading\n"
        "from rclpy.node import Node\n"
        "from ab_sim.nodes.process import run_node\n"
        "class Stuck(Node):\n"
        "    def destroy_node(self):\n"
        "        threading.Event().wait()\n"
        "run_node(lambda: Stuck('stuck'), lambda node, stopping: stopping.wait())\n"
    )
    fleet.start_process("stuck", sys.executable, "-c", program)
    fleet.until(lambda: "stuck" in fleet.node.get_node_names(), "it is there")
    assert fleet.stop("stuck") == 0

"""Orderly exit of a node from the graph, so that peers see it leave."""

import os
import threading
import time
from collections.abc import Callable

from rclpy.action import ActionServer
from rclpy.node import Node

HEARD = 0.2
"""Time for peers to notice that the node has gone, before its participant leaves [s]. With a peer
that was repeatedly paused for up to 0.15 s, 0.1 s was too short in 2 of 80 exits."""

LONGEST = 5.0
"""Longest time for leaving the graph [s]; on a busy machine it takes 1 s."""


def leave_graph(node: Node, longest: float = LONGEST) -> bool:
    """Destroy the only node of a process, and its DDS participant.

    Args:
        node: node to destroy.
        longest: longest time to wait [s].

    Returns:
        True if both were destroyed in time; see ``completes``.
    """
    return completes(lambda: _leave_graph(node), longest)


def completes(destroy: Callable[[], None], longest: float = LONGEST) -> bool:
    """Destroy ROS nodes in a separate thread, and return whether it finished.

    Fast DDS 3.2 may deadlock if a peer leaves at the same time, as in 1 of 90 runs of
    ``ab-sim demo``: a thread that removes the peer's writer holds the lock of the participant's
    discovery and waits for a timer, whose thread waits for this lock.

    Args:
        destroy: function that destroys the nodes.
        longest: longest time to wait [s].

    Returns:
        True if the nodes were destroyed. If not, ROS must not be called again, and only
        ``interruption.exit_process`` ends the process.
    """
    failures: list[BaseException] = []

    def leave() -> None:
        try:
            destroy()
        except BaseException as failure:
            failures.append(failure)

    leaving = threading.Thread(target=leave, name="leaving", daemon=True)
    leaving.start()
    leaving.join(longest)
    if failures:
        raise failures[0]
    return not leaving.is_alive()


def _leave_graph(node: Node) -> None:
    """Destroy the node, then the participant.

    Peers keep two lists in two threads: the participants, and the nodes that each participant has
    announced. If a peer processes the last announcement of a participant after the participant has
    left, it lists the nodes forever (``update_participant_entities`` of rmw_dds_common adds them
    again). This happened in 2 of 725 exits, and in 14 of 180 with a peer that was sometimes paused.
    Therefore the participant first announces that the node has gone. This requires another, hidden
    node, because the participant disappears together with its last node.
    """
    last = Node(
        f"_ab_sim_{os.getpid()}",
        context=node.context,
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
    )
    with last.handle:  # destroyed at the end of this block, after everything that belongs to it
        for waitable in tuple(node.waitables):
            if isinstance(waitable, ActionServer):
                waitable.destroy()  # `destroy_node` does not, and the node would remain visible
        node.destroy_node()
        last.destroy_node()
        time.sleep(HEARD)

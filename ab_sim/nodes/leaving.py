"""How a node leaves the graph, so that nobody goes on to see it."""

import os
import threading
import time

from rclpy.node import Node

HEARD = 0.2
"""s for others to take in that the node has gone, before they hear that its participant has. For a
program that is paused for up to 0.15 s again and again, 0.1 s was too short in 2 of 80 ends."""

LONGEST = 5.0
"""s for all of it; on a busy machine it takes one."""


def leave_graph(node: Node, longest: float = LONGEST) -> bool:
    """Destroy a process's only node, and its DDS participant.

    Fast DDS 3.2 may wait for itself while a peer leaves at the same time, as in 1 of 90 runs of
    ``ab-sim demo``: a thread that removes the peer's writer has the lock of the participant's
    discovery and waits for a timer, whose thread waits for that lock.

    Args:
        node: to be destroyed.
        longest: how long to wait [s].

    Returns:
        Whether it is done. If not, ROS must not be called again, and nothing but
        ``interruption.leave`` ends the process.
    """
    failures: list[BaseException] = []

    def leave() -> None:
        try:
            _leave_graph(node)
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

    Others keep two things by two threads: which participants there are, and which nodes each has
    said to have. What a participant said last, and they take in after it has gone, they keep for
    ever (``update_participant_entities`` of rmw_dds_common adds it again): after 2 of 725 ends, and
    14 of 180 where the other's process paused now and then, it went on to see the node. So the
    participant first says that the node has gone. It does so with a further node, hidden by its
    name, as the last one takes the participant with it at once.
    """
    last = Node(
        f"_ab_sim_{os.getpid()}",
        context=node.context,
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
    )
    with last.handle:  # it is destroyed at the end of this, behind all that it had
        node.destroy_node()
        last.destroy_node()
        time.sleep(HEARD)

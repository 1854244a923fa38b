"""How a node leaves the graph, so that nobody goes on to see it."""

import os
import time

from rclpy.node import Node

HEARD = 0.2
"""s for others to take in that the node has gone, before they hear that its participant has. For a
program that is paused for up to 0.15 s again and again, 0.1 s was too short in 2 of 80 ends."""


def leave_graph(node: Node) -> None:
    """Destroy a process's only node, and its DDS participant.

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

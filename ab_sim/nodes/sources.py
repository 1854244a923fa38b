"""Number of nodes that command a drive, from the publishers that DDS lists; no ROS."""

from collections import Counter
from collections.abc import Collection, Sequence
from typing import NamedTuple

PARTICIPANT = 12
"""Length of the part of an endpoint's identifier that identifies its participant [bytes]."""


class Endpoint(NamedTuple):
    """Publisher of commands."""

    topic: str
    node: str
    """Full name of the publisher's node."""
    gid: bytes
    """Identifier of the publisher in DDS."""


class Sources(NamedTuple):
    """Nodes that command a drive."""

    alive: int = 0
    """Number of sources; a node with publishers on several topics counts once."""
    dead: int = 0
    """Number of publishers that may be dead, although their DDS lease has not ended."""

    @staticmethod
    def of(
        endpoints: Sequence[Endpoint], heard: Collection[bytes], lately: set[bytes]
    ) -> "Sources":
        """Count the sources among publishers, by the messages received from them.

        DDS lists a killed process for another 20 s. It does not count if another process with a
        node of the same name has recently sent, because the node was then restarted. A publisher
        without recent messages may be dead, or may only send changes.

        Args:
            endpoints: all publishers that DDS lists.
            heard: identifiers of the publishers that have sent a message at any time.
            lately: identifiers of the publishers that have recently sent a message.
        """
        talking = {
            (endpoint.node, endpoint.gid[:PARTICIPANT])
            for endpoint in endpoints
            if endpoint.gid in lately
        }
        names = {node for node, _ in talking}
        publishers = Counter[tuple[str, bytes, str]]()
        dead = 0
        for topic, node, gid in endpoints:
            talks = (node, gid[:PARTICIPANT]) in talking
            if talks or node not in names:
                publishers[node, gid[:PARTICIPANT], topic] += 1
            dead += not talks and (node in names or gid in heard)
        counts = dict[tuple[str, bytes], int]()
        for (node, participant, _), count in publishers.items():
            source = node, participant
            counts[source] = max(counts.get(source, 0), count)
        return Sources(sum(counts.values()), dead)

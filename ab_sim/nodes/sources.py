"""Number of nodes that command a drive, of publishers that DDS still lists; no ROS."""

from collections import Counter
from collections.abc import Collection, Sequence
from typing import NamedTuple

PARTICIPANT = 12
"""Length of the part of an endpoint's identifier that names its participant, i.e. its process."""


class Endpoint(NamedTuple):
    """A publisher of commands."""

    topic: str
    node: str
    """Full name of its node."""
    gid: bytes
    """Identifier in DDS."""


class Sources(NamedTuple):
    """Nodes that command a drive."""

    alive: int = 0
    """Number of sources; a node on both topics counts once."""
    dead: int = 0
    """Number of publishers that may be dead, although their DDS lease has not ended."""

    @staticmethod
    def of(
        endpoints: Sequence[Endpoint], heard: Collection[bytes], lately: set[bytes]
    ) -> "Sources":
        """Count publishers, by DDS's list and by the messages received.

        A killed process stays in the list for 20 s. It does not count if another process with a
        node of the same name has sent lately, because the node was then restarted. A publisher
        without recent messages may be dead, or may hold its command.

        Args:
            endpoints: all publishers in DDS's list.
            heard: identifiers of publishers that have ever sent.
            lately: identifiers of publishers that have sent lately.
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

"""What a drive's node says on its topics, whichever drive it is."""

from collections.abc import Iterable, Mapping, Sequence, Set
from pathlib import Path

from rclpy.node import Node

from ab_msgs_py import Block, Health, Level, Task, topics
from ab_msgs_py.prefilled import Prefilled
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.observed import Observed
from ab_sim.scene import Scene


class Outputs:
    """The topics that are there as long as the node: who listens is found before there is a drive.

    Args:
        node: it publishes as.
        scene: the one it begins with, a name or a file.
        hardware: what the drive is called in the diagnostics; empty: by namespace and scene.
        clock: whether simulated time is published.
    """

    def __init__(self, node: Node, scene: str, hardware: str, clock: bool) -> None:
        self._node, self._hardware, self._scene = node, hardware, Path(scene).stem
        self._observed = Observed(node)
        self._block = topics.BLOCK.publisher(node)
        self._clock = topics.CLOCK.publisher(node) if clock else None
        self._now = Prefilled(topics.CLOCK.message(0))
        self._diagnostics = topics.DIAGNOSTICS.publisher(node)

    def begin(self, scene: Scene, channels: Sequence[str]) -> None:
        """What is told of from now on."""
        self._scene = scene.name
        self._observed.begin(scene, channels)

    def end(self) -> None:
        """There is nothing to tell of any more."""
        self._observed.end()

    def sampled(self, runs: Iterable[Trajectory], faults: ActiveFaults) -> None:
        """Every sample of accelerometers in some integration steps."""
        self._observed.sampled(runs, faults)

    def look(self, present: Trajectory, faults: ActiveFaults) -> tuple[list[float], Set[str]]:
        """What is to be shown of the last sample, and which sensors say nothing of it."""
        shown = self._observed.look(present)
        if not shown or not faults.faults:
            return shown, frozenset()
        return shown, self._observed.heard(shown, present, faults)

    def show(self, time_ns: int, shown: list[float], silent: Set[str]) -> None:
        """That, at a simulated time."""
        self._observed.publish(time_ns, shown, silent)
        self.tell_time(time_ns)

    def tell_time(self, time_ns: int) -> None:
        """Simulated time."""
        if self._clock is not None:
            self._clock.handle.publish_raw(self._now.at(time_ns, ()))

    def write(self, parts: Sequence[Trajectory]) -> None:
        """A block of the samples in these, if there are any."""
        if parts and len(block := Trajectory.join(list(parts))):
            self._block.publish(topics.block_bytes(Block(block.channels, block.samples)))

    def report(
        self, time_ns: int, level: Level, text: str, values: Mapping[str, str] | None = None
    ) -> None:
        """The node's health."""
        node = self._node
        hardware = self._hardware or f"{node.get_namespace()}/{self._scene}".lstrip("/")
        name = node.get_fully_qualified_name()
        health = Health(name, Task.DRIVE, level, text, dict(values or {}), hardware, time_ns)
        self._diagnostics.publish(topics.DIAGNOSTICS.message(health))

    def rival(self) -> str:
        """What is wrong if somebody else tells the time, too; nothing, if nobody does."""
        if self._clock is None or topics.CLOCK.publishers(self._node) < 2:
            return ""
        clock = self._node.resolve_topic_name(topics.CLOCK.name)
        return f"another simulator publishes {clock}: remap one of them, or use another domain"

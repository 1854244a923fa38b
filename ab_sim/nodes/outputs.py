"""Publishers of a drive's node."""

from collections.abc import Mapping, Sequence, Set
from pathlib import Path

from rclpy.node import Node

from ab_msgs_py import Block, Level, Task, topics
from ab_msgs_py.prefilled import Prefilled
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.diagnostics_publisher import DiagnosticsPublisher
from ab_sim.nodes.state_publishers import StatePublishers
from ab_sim.scene import Scene


class Outputs:
    """Publishers that exist as long as the node: subscribers are matched before a scene is loaded.

    Args:
        node: publishing node.
        scene: name or file of the first scene.
        hardware: ``hardware_id`` in the diagnostics; empty: namespace and scene.
        clock: whether simulated time is published.
    """

    def __init__(self, node: Node, scene: str, hardware: str, clock: bool) -> None:
        self._node, self._hardware, self._scene = node, hardware, Path(scene).stem
        self._observed = StatePublishers(node)
        self._block = topics.BLOCK.publisher(node)
        self._clock = topics.CLOCK.publisher(node) if clock else None
        self._now = Prefilled(topics.CLOCK.message(0))
        self._diagnostics = DiagnosticsPublisher(node, Task.DRIVE)

    def begin(self, scene: Scene, channels: Sequence[str]) -> None:
        """Publish a drive of this scene from now on."""
        self._scene = scene.name
        self._observed.begin(scene, channels)

    def end(self) -> None:
        """Clear the latched topics: no scene is loaded."""
        self._observed.end()

    def sampled(self, runs: Sequence[Trajectory], faults: ActiveFaults) -> None:
        """Publish every sensor sample of some integration steps, and the vector once per turn."""
        self._observed.sampled(runs, faults)

    def state_values(
        self, present: Trajectory, faults: ActiveFaults
    ) -> tuple[list[float], Set[str]]:
        """Return the numbers of the state messages of the last sample, and the silent sensors."""
        values = self._observed.values_of(present)
        if not values or not faults.faults:
            return values, frozenset()
        return values, self._observed.with_sensor_faults(values, present, faults)

    def publish_state(self, time_ns: int, values: list[float], silent: Set[str]) -> None:
        """Publish numbers of the state, and the clock."""
        self._observed.publish(time_ns, values, silent)
        self.publish_clock(time_ns)

    def publish_clock(self, time_ns: int) -> None:
        """Publish simulated time."""
        if self._clock is not None:
            self._clock.handle.publish_raw(self._now.at(time_ns, ()))

    def write(self, parts: Sequence[Trajectory]) -> None:
        """Publish a block with the samples of these trajectories, if there are any."""
        if parts and len(block := Trajectory.join(list(parts))):
            self._block.publish(topics.block_bytes(Block(block.channels, block.samples)))

    def report(
        self,
        time_ns: int,
        level: Level,
        text: str,
        values: Mapping[str, str] | None = None,
        logged: bool = False,
    ) -> None:
        """Publish the node's diagnostics; ``logged``: the text is in the log already."""
        hardware = self._hardware or f"{self._node.get_namespace()}/{self._scene}".lstrip("/")
        self._diagnostics.publish(level, text, values or {}, time_ns, hardware, logged)

    def other_clock(self) -> str:
        """Return an error text if another node publishes the same clock; empty if not."""
        if self._clock is None or topics.CLOCK.publishers(self._node) < 2:
            return ""
        clock = self._node.resolve_topic_name(topics.CLOCK.name)
        return f"another simulator publishes {clock}: remap one of them, or use another domain"

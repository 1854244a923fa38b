"""Publisher of a node's diagnostics, with a line in the log at each change of the level."""

from collections.abc import Mapping

from rclpy.node import Node

from ab_msgs_py import Health, Level, Task, topics
from ab_sim.nodes.parameters import PARAMETERS, changed_parameters


class DiagnosticsPublisher:
    """Publishes a node's diagnostics, and logs each change of their level.

    Args:
        node: publishing node.
        task: task of the node, which is part of the entry's name.
    """

    def __init__(self, node: Node, task: Task) -> None:
        self._node, self._task = node, task
        self._topic = topics.DIAGNOSTICS.publisher(node)
        self._level = Level.OK

    def publish(
        self,
        level: Level,
        text: str,
        values: Mapping[str, str],
        time_ns: int,
        hardware: str = "ab_sim",
        logged: bool = False,
    ) -> bool:
        """Publish the present state and the node's parameters.

        Args:
            level: level of the state.
            text: description of the state.
            values: values by name, with units in the names.
            time_ns: simulated time [ns].
            hardware: ``hardware_id`` of the entry.
            logged: whether the text has already been logged.

        Returns:
            True if the text has been logged, now or before.
        """
        name = self._node.get_fully_qualified_name()
        entries = {**values, PARAMETERS: changed_parameters(self._node)}
        health = Health(name, self._task, level, text, entries, hardware, time_ns)
        self._topic.publish(topics.DIAGNOSTICS.message(health))
        before, self._level = self._level, level
        if level is not before and not logged:
            self._log(level, text)
        return logged or level is not before

    def _log(self, level: Level, text: str) -> None:
        logger = self._node.get_logger()
        if level is Level.ERROR:
            logger.error(text)
        elif level is Level.WARN:
            logger.warning(text)
        else:
            logger.info(f"no more warnings: {text}")

"""A node's health as one entry of ``/diagnostics``; units stand in the keys."""

import enum
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from ab_msgs_py.samples import stamp


class Level(enum.Enum):
    """How well a node is."""

    OK = DiagnosticStatus.OK
    WARN = DiagnosticStatus.WARN
    ERROR = DiagnosticStatus.ERROR


class Task(enum.Enum):
    """What a node's health is about; by these, ours are told from other hardware's."""

    DRIVE = "real time"
    PROFILE = "profile"
    RECORDING = "recording"


ENDED = "ended"
"""Message of a node's last health, sent when it ends in order."""


@dataclass(frozen=True)
class Health:
    """Health of one node."""

    node: str
    task: Task
    level: Level
    message: str
    values: dict[str, str] = field(default_factory=dict)
    hardware: str = "ab_sim"

    @property
    def namespace(self) -> str:
        """The node's namespace."""
        return self.node.rpartition("/")[0] or "/"

    def message_at(self, time: int) -> DiagnosticArray:
        """As ``/diagnostics``, stamped with a time [ns]."""
        status = DiagnosticStatus(
            level=self.level.value,
            name=f"{self.node}: {self.task.value}",
            message=self.message,
            hardware_id=self.hardware,
            values=[KeyValue(key=key, value=value) for key, value in self.values.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = stamp(time)
        return array

    @classmethod
    def all_of(cls, array: DiagnosticArray) -> list["Health"]:
        """Every ab_sim entry of a message; other hardware's are left out."""
        levels = {level.value: level for level in Level}
        tasks = {task.value: task for task in Task}
        return [
            cls(
                node,
                tasks[task],
                levels.get(status.level, Level.ERROR),
                str(status.message),
                {str(pair.key): str(pair.value) for pair in status.values},
                str(status.hardware_id),
            )
            for status in array.status
            for node, _, task in [str(status.name).partition(": ")]
            if task in tasks
        ]

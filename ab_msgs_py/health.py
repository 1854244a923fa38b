"""A node's health as one entry of ``/diagnostics``; units stand in the keys."""

import enum
from dataclasses import dataclass, field
from typing import Any

from ab_msgs_py.ros_messages import Fields
from ab_msgs_py.samples import header, nanoseconds_of


class Level(enum.Enum):
    """How well a node is, as DiagnosticStatus says it."""

    OK = 0
    WARN = 1
    ERROR = 2


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
    time: int = 0
    """Simulated time [ns]."""

    @property
    def namespace(self) -> str:
        """The node's namespace."""
        return self.node.rpartition("/")[0] or "/"

    def fields(self) -> Fields:
        """As a DiagnosticArray of this entry."""
        values = [{"key": key, "value": value} for key, value in self.values.items()]
        status = {
            "level": bytes([self.level.value]),
            "name": f"{self.node}: {self.task.value}",
            "message": self.message,
            "hardware_id": self.hardware,
            "values": values,
        }
        return {"header": header(self.time, ""), "status": [status]}

    @classmethod
    def all_of(cls, array: Any) -> list["Health"]:
        """Every ab_sim entry of a message; other hardware's are left out."""
        # ROS has it as a byte, files as a number.
        levels = {each: level for level in Level for each in (level.value, bytes([level.value]))}
        tasks = {task.value: task for task in Task}
        return [
            cls(
                node,
                tasks[task],
                levels.get(status.level, Level.ERROR),
                str(status.message),
                {str(pair.key): str(pair.value) for pair in status.values},
                str(status.hardware_id),
                nanoseconds_of(array.header.stamp),
            )
            for status in array.status
            for node, _, task in [str(status.name).partition(": ")]
            if task in tasks
        ]

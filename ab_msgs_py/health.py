"""Health of a node as one entry of ``/diagnostics``; units are in the keys."""

import enum
from dataclasses import dataclass, field
from typing import Any

from ab_msgs_py.ros_messages import Fields
from ab_msgs_py.samples import header, nanoseconds_of


class Level(enum.Enum):
    """Severity of a node's state, as in DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class Task(enum.Enum):
    """Subject of a node's health, by which entries of ab_sim are recognised."""

    DRIVE = "real time"
    PROFILE = "profile"
    RECORDING = "recording"


ENDED = "ended"
"""Message of a node's last health entry, sent at an orderly exit."""


@dataclass(frozen=True)
class Health:
    """Health of one node, as a status of the diagnostics."""

    node: str
    """Full name of the node, with its namespace."""
    task: Task
    level: Level
    message: str
    """State in a few words, for users."""
    values: dict[str, str] = field(default_factory=dict)
    """Further numbers as texts; a key is a name with the unit in brackets."""
    hardware: str = "ab_sim"
    """Name of the hardware that is monitored."""
    time: int = 0
    """Simulated time [ns]."""

    @property
    def namespace(self) -> str:
        """Return the namespace of the node."""
        return self.node.rpartition("/")[0] or "/"

    def fields(self) -> Fields:
        """Return the fields of a DiagnosticArray whose only status is this one."""
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
        """Return those entries of a DiagnosticArray whose task is one of ab_sim's nodes."""
        # ROS stores the level as a byte, bag files as a number.
        levels = {
            spelling: level for level in Level for spelling in (level.value, bytes([level.value]))
        }
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

"""The topic contract: each topic's name, type, QoS, unit, meaning and conversion, declared once.

Nobody else touches message fields. Only what makes ROS's messages, publishers and services needs
ROS. All topic names are relative, so a node's namespace applies;
only ``/clock`` and ``/diagnostics`` are absolute.
"""

from ab_msgs_py.block import Block
from ab_msgs_py.errors import MalformedMessage
from ab_msgs_py.health import ENDED, Health, Level, Task
from ab_msgs_py.imu import ImuSample
from ab_msgs_py.samples import JointSample, PoseSample, VibrationSample, WhirlSample
from ab_msgs_py.topic import Conversion, Qos, Topic

__all__ = [
    "ENDED",
    "Block",
    "Conversion",
    "Health",
    "ImuSample",
    "JointSample",
    "Level",
    "MalformedMessage",
    "PoseSample",
    "Qos",
    "Task",
    "Topic",
    "VibrationSample",
    "WhirlSample",
]

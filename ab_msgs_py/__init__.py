"""The topic contract: names, QoS, and typed samples to and from standard ROS messages.

Nobody else touches message fields. All topic names are relative, so a node's namespace applies;
only ``/clock`` and ``/diagnostics`` are absolute.
"""

from ab_msgs_py.block import Block
from ab_msgs_py.errors import MalformedMessage
from ab_msgs_py.health import ENDED, Health, Level, Task
from ab_msgs_py.imu import ImuSample
from ab_msgs_py.samples import JointSample, PoseSample, VibrationSample, WhirlSample
from ab_msgs_py.topics import Topic

__all__ = [
    "ENDED",
    "Block",
    "Health",
    "ImuSample",
    "JointSample",
    "Level",
    "MalformedMessage",
    "PoseSample",
    "Task",
    "Topic",
    "VibrationSample",
    "WhirlSample",
]

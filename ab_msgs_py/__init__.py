"""Topic contract: name, type, QoS, unit, meaning and conversion of each topic, declared once.

No other package reads or writes message fields. ROS is only needed to create messages, publishers
and services. Topic names are relative to a node's namespace, except those that begin with a slash,
such as ``/clock`` and ``/diagnostics``.
"""

from ab_msgs_py.block import Block
from ab_msgs_py.health import ENDED, Health, Level, Task
from ab_msgs_py.ros_messages import MalformedMessage
from ab_msgs_py.samples import ImuSample, JointSample, PoseSample, VibrationSample, WhirlSample
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

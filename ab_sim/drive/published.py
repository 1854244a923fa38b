"""Topics of a drive's state, and the channels that supply the numbers of their messages.

Nodes publish these topics at every wake-up, and exported bags contain them. A further topic needs
one further function here.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from ab_msgs_py import JointSample, PoseSample, Topic, VibrationSample, WhirlSample, topics
from ab_msgs_py.samples import HOUSING, frame_of
from ab_sim.drive.faults.fault import SPINDLE, VIBRATION

CONSTANTS = {"zero": 0.0, "one": 1.0, "none": math.nan}
"""Constant numbers of messages by name, in addition to the channels."""
_TURNING = ("turning x", "turning y", "turning z")
"""Names of the deck's angular acceleration on inertial axes; no channel's name has a blank."""
AXES, _NO_TURN = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
"""Placeholders for a vector and for a quaternion (w, x, y, z) in templates of messages."""


class Template(NamedTuple):
    """Template of messages that differ only in stamps and numbers."""

    sample: Any
    """Sample from which the template is made; its numbers are placeholders."""
    numbers: Sequence[str]
    """Names of the numbers that fill the message, in the order of the message's fields."""
    sensor: str = ""
    """Sensor that reports the numbers; empty for the true state."""


class StateChannels(NamedTuple):
    """Names of the numbers in the messages of a drive's state."""

    namespace: str
    """Namespace of the drive, which is also a part of all frame names."""
    channels: Sequence[str]
    balls: int
    sensors: Sequence[str]
    """Names of the accelerometers."""

    @property
    def names(self) -> list[str]:
        """Return the names of all published numbers.

        These are channels, constants, efforts and angular acceleration.
        """
        return [*self.channels, *CONSTANTS, *map(effort, range(self.balls)), *_TURNING]

    @property
    def tilts(self) -> bool:
        """Return whether the deck moves in space."""
        return "qw" in self.channels

    def has(self, *channels: str) -> bool:
        """Return whether the drive has all the named channels."""
        return {*channels} <= {*self.channels}

    def or_zero(self, *channels: str) -> list[str]:
        """Return the names, with ``zero`` in place of missing channels: a planar deck has no z."""
        return [name if name in self.channels else "zero" for name in channels]

    def frame(self, name: str) -> str:
        """Return the full name of one of the drive's frames, with the namespace."""
        return frame_of(self.namespace, name)


TemplatesOf = Callable[[StateChannels], Iterator[Template]]
STATE_TOPICS: dict[Topic, TemplatesOf] = {}
"""Templates of each topic of the state, in the order of publication."""


def state_topic(topic: Topic) -> Callable[[TemplatesOf], TemplatesOf]:
    """Return a decorator that registers the function with the templates of a topic."""

    def register(function: TemplatesOf) -> TemplatesOf:
        STATE_TOPICS[topic] = function
        return function

    return register


def effort(ball: int) -> str:
    """Return the name of the torque that drives a ball about the shaft."""
    return f"effort of ball {ball}"


@state_topic(topics.JOINT_STATES)
def _joints(channels: StateChannels) -> Iterator[Template]:
    balls, none = range(channels.balls), (0.0,) * channels.balls
    angles = ["angle", *(f"ball_{i}_angle" for i in balls)]
    rates = ["speed", *(f"ball_{i}_rate" for i in balls)]
    if channels.has(*angles, *rates):
        torque = "motor_torque" if channels.has("motor_torque") else "none"
        sample = JointSample(0, 0.0, 0.0, none, none, none, 0.0, channels.frame(HOUSING))
        yield Template(sample, [*angles, *rates, torque, *map(effort, balls)], SPINDLE)


@state_topic(topics.VIBRATION)
def _vibration(channels: StateChannels) -> Iterator[Template]:
    """Yield a template for each accelerometer, or one for the deck if there is none."""
    sensors = [name for name in channels.sensors if channels.has(f"{name}_1")]
    for name in sensors:
        read = channels.or_zero(f"{name}_1", f"{name}_2", f"{name}_3")
        sample = VibrationSample(0, AXES, frame=channels.frame(name))
        yield Template(sample, [*read, "zero", "zero", "zero"], name)
    if not sensors and channels.has("ax", "ay"):
        sample = VibrationSample(0, AXES, frame=channels.frame(HOUSING))
        yield Template(sample, [*channels.or_zero("ax", "ay", "az"), *_TURNING], VIBRATION)


@state_topic(topics.WHIRL)
def _whirl(channels: StateChannels) -> Iterator[Template]:
    if channels.has("x", "y"):
        sample = WhirlSample(0, AXES, channels.frame(HOUSING))
        yield Template(sample, channels.or_zero("x", "y", "z"))


@state_topic(topics.DECK_POSE)
def pose(channels: StateChannels) -> Iterator[Template]:
    """Yield the template of the deck's pose, also for tf."""
    if channels.has("x", "y"):
        turn = ["qx", "qy", "qz", "qw"] if channels.tilts else ["zero", "zero", "zero", "one"]
        sample = PoseSample(0, AXES, _NO_TURN, channels.frame(HOUSING))
        yield Template(sample, [*channels.or_zero("x", "y", "z"), *turn])

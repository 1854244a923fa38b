"""What a drive shows of itself: of each topic of its state, which numbers go into its messages.

Nodes publish it at every wake-up, and bags have it of a recording. A topic more is a function more.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from ab_msgs_py import JointSample, PoseSample, Topic, VibrationSample, WhirlSample, topics
from ab_msgs_py.samples import HOUSING, frame_of
from ab_sim.drive.faults.fault import SPINDLE, VIBRATION

CONSTANTS = {"zero": 0.0, "one": 1.0, "none": math.nan}
"""Numbers of messages for which a drive has nothing to show."""
TURNING = ("turning x", "turning y", "turning z")
"""The deck's angular acceleration, inertial axes. No channel has a blank in its name."""
AXES, NO_TURN = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
"""What messages are made with; whatever they show is written over it."""


class Template(NamedTuple):
    """Messages that are alike but for stamps and numbers."""

    sample: Any
    """What they are made of, with whatever numbers."""
    numbers: Sequence[str]
    """Names of their numbers, in the order of the message's fields."""
    sensor: str = ""
    """Which says so; empty: what is true."""


class Shown(NamedTuple):
    """What there is to show."""

    namespace: str
    """The drive's, part of its frames' names."""
    channels: Sequence[str]
    balls: int
    sensors: Sequence[str]
    """Accelerometers."""

    @property
    def names(self) -> list[str]:
        """Of all numbers: channels, constants, the balls' efforts, the deck's turning."""
        return [*self.channels, *CONSTANTS, *map(effort, range(self.balls)), *TURNING]

    @property
    def tilts(self) -> bool:
        """Whether it is of a deck in space."""
        return "qw" in self.channels

    def has(self, *channels: str) -> bool:
        """Whether these are known."""
        return {*channels} <= {*self.channels}

    def known(self, *channels: str) -> list[str]:
        """The same, and zero for those that are not: a deck in the plane has no z."""
        return [name if name in self.channels else "zero" for name in channels]

    def frame(self, name: str) -> str:
        """A frame's full name."""
        return frame_of(self.namespace, name)


Shows = Callable[[Shown], Iterator[Template]]
SHOWN: dict[Topic, Shows] = {}
"""What goes on each topic of the state, in the order in which it is published."""


def shows(topic: Topic) -> Callable[[Shows], Shows]:
    """Say what goes on a topic, for each drive that has the channels; by a decorator."""

    def register(function: Shows) -> Shows:
        SHOWN[topic] = function
        return function

    return register


def effort(ball: int) -> str:
    """Name of the torque that drives a ball about the shaft."""
    return f"effort of ball {ball}"


@shows(topics.JOINT_STATES)
def _joints(shown: Shown) -> Iterator[Template]:
    balls, none = range(shown.balls), (0.0,) * shown.balls
    angles = ["angle", *(f"ball_{i}_angle" for i in balls)]
    rates = ["speed", *(f"ball_{i}_rate" for i in balls)]
    if shown.has(*angles, *rates):
        torque = "motor_torque" if shown.has("motor_torque") else "none"
        sample = JointSample(0, 0.0, 0.0, none, none, none, 0.0, shown.frame(HOUSING))
        yield Template(sample, [*angles, *rates, torque, *map(effort, balls)], SPINDLE)


@shows(topics.VIBRATION)
def _vibration(shown: Shown) -> Iterator[Template]:
    """Of each accelerometer, or of the deck if there is none."""
    sensors = [name for name in shown.sensors if shown.has(f"{name}_1")]
    for name in sensors:
        read = shown.known(f"{name}_1", f"{name}_2", f"{name}_3")
        sample = VibrationSample(0, AXES, frame=shown.frame(name))
        yield Template(sample, [*read, "zero", "zero", "zero"], name)
    if not sensors and shown.has("ax", "ay"):
        sample = VibrationSample(0, AXES, frame=shown.frame(HOUSING))
        yield Template(sample, [*shown.known("ax", "ay", "az"), *TURNING], VIBRATION)


@shows(topics.WHIRL)
def _whirl(shown: Shown) -> Iterator[Template]:
    if shown.has("x", "y"):
        yield Template(WhirlSample(0, AXES, shown.frame(HOUSING)), shown.known("x", "y", "z"))


@shows(topics.DECK_POSE)
def pose(shown: Shown) -> Iterator[Template]:
    """The deck's, also for tf."""
    if shown.has("x", "y"):
        turn = ["qx", "qy", "qz", "qw"] if shown.tilts else ["zero", "zero", "zero", "one"]
        sample = PoseSample(0, AXES, NO_TURN, shown.frame(HOUSING))
        yield Template(sample, [*shown.known("x", "y", "z"), *turn])

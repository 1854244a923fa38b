"""A velocity controller of ros2_control, by what its topic hardware publishes.

The plug-in itself, joint_state_topic_hardware_interface (C++), is not run: `Hardware` does what its
sources do in `write`.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import JointSample, topics
from tests.domains import own_domain
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros

DRIVE = "drive_sim"
THRESHOLD = 1e-6
"""Summed difference between state and command below which nothing is sent."""


class Hardware:
    """The velocity command interface of the joint `spindle`; NaN until a controller is active."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet, self.command = fleet, np.nan
        self.sent = 0

    @property
    def state(self) -> float:
        """Newest speed in joint_states [rad/s]."""
        heard = self._fleet.heard["joint_states"]
        return JointSample.of(heard[-1]).spindle_speed if heard else np.nan

    def write(self) -> None:
        """Publish the command, if the state differs from it; it does from NaN."""
        if abs(self.state - self.command) <= THRESHOLD:
            return
        self.sent += 1
        self._fleet.publish(topics.JOINT_COMMAND, topics.JOINT_COMMAND.message(self.command))


@pytest.fixture
def drive(tmp_path: Any) -> Iterator[Fleet]:
    with own_domain() as domain:
        fleet = Fleet(domain, tmp_path)
        fleet.start(DRIVE, command_age_limit=0.2, command_silence="coast")
        fleet.listen(topics.JOINT_STATES)
        fleet.until(lambda: fleet.heard["joint_states"], "the drive runs")
        yield fleet
        fleet.close()


def test_a_velocity_controller_holds_its_speed(drive: Fleet) -> None:
    """The watchdog does not act although nothing is sent at the speed; then the sender leaves."""
    hardware = Hardware(drive)
    for _ in range(3):
        hardware.write()
    refusal = "spindle/joint_command, refused: velocity of spindle is NaN"
    drive.reads(DRIVE, refusal)
    hardware.command = 4.0

    def there() -> bool:
        hardware.write()
        return hardware.state == 4.0

    drive.until(there, "it is at the speed")
    hardware.write()
    assert drive.log(DRIVE).count(refusal) == 1
    sent, begin = hardware.sent, len(drive.heard["joint_states"])
    # Half a second of simulated time, of which the age limit is less than a half.
    drive.until(lambda: len(drive.heard["joint_states"]) > begin + 125, "time goes on")
    speeds = [JointSample.of(each).spindle_speed for each in drive.heard["joint_states"][begin:]]
    assert set(speeds) == {4.0} and hardware.sent == sent
    assert drive.value(DRIVE, "watchdog has acted") == "0"
    drive.node.destroy_publisher(drive.publishers.pop(topics.JOINT_COMMAND.name))
    drive.until(lambda: hardware.state < 4.0, "the watchdog lets it coast")


def test_what_is_no_command_of_the_spindle_is_refused_once(drive: Fleet) -> None:
    hardware = Hardware(drive)
    message = topics.JOINT_COMMAND.message(3.0)
    other = topics.JOINT_COMMAND.message(5.0)
    other.name = ["ball_0"]
    both = topics.JOINT_COMMAND.message(5.0)
    both.position = [1.0]
    drive.publish(topics.JOINT_COMMAND, other, both, other, both, message)
    drive.until(lambda: hardware.state == 3.0, "it follows the valid one")
    drive.reads(DRIVE, "refused: name = ['ball_0']: must be ['spindle']; logged once")
    drive.reads(DRIVE, "refused: must have one velocity, and neither position nor effort")
    drive.until(lambda: drive.value(DRIVE, "commands rejected") == "4", "all are counted")
    assert drive.log(DRIVE).count("refused:") == 2


def test_the_last_one_leads(drive: Fleet) -> None:
    hardware = Hardware(drive)
    drive.publish(topics.JOINT_COMMAND, topics.JOINT_COMMAND.message(3.0))
    drive.until(lambda: hardware.state == 3.0, "it follows")
    drive.command(2.5)
    drive.until(lambda: hardware.state == 2.5, "the speed leads")
    drive.until(lambda: hardware.state < 2.5, "and is not renewed: the watchdog acts")

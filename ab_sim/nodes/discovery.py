"""Who can find our nodes: this machine, and at once, unless the user has said otherwise."""

import os
from pathlib import Path

DISCOVERY_RANGE, RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
"""ROS's variable, and what it is for us unless the user has set it."""
PROFILES = Path(__file__).with_suffix(".xml")
"""How Fast DDS announces us to this machine, and how soon it repeats what got lost."""
PROFILES_NAMED_BY = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")
"""Variables of Fast DDS: from version 3 on (ROS 2 Kilted), and before (Jazzy)."""


def ends_here() -> bool:
    """Whether discovery, as the environment has it, ends at this machine."""
    reach = os.environ.get(DISCOVERY_RANGE, RANGE)
    return reach == RANGE and not os.environ.get("ROS_STATIC_PEERS")


def prepare() -> None:
    """Set the environment for ``rclpy.init``; what the user has set stays.

    A drive obeys whoever it discovers, so it takes a user who sets
    ``ROS_AUTOMATIC_DISCOVERY_RANGE`` for others to come in. Frequent announcements are for this
    machine alone; no other host is sent them.
    """
    os.environ.setdefault(DISCOVERY_RANGE, RANGE)
    if ends_here() and not os.environ.keys() & {*PROFILES_NAMED_BY}:
        os.environ.update(dict.fromkeys(PROFILES_NAMED_BY, str(PROFILES)))

"""Who can find our nodes: this machine, and at once, unless the user has said otherwise."""

import os
from importlib.metadata import version
from pathlib import Path

DISCOVERY_RANGE, RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
"""ROS's variable, and what it is for us unless the user has set it."""
PROFILES = {
    2: ("FASTRTPS_DEFAULT_PROFILES_FILE", Path(__file__).with_name("discovery_fast_dds_2.xml")),
    3: ("FASTDDS_DEFAULT_PROFILES_FILE", Path(__file__).with_suffix(".xml")),
}
"""Environment variable and file of profiles for each major version of Fast DDS.

The profiles say how Fast DDS announces us to this machine, and how soon it repeats what got lost.
Fast DDS 2 refuses the file for 3. With 3, rmw_fastrtps warns if the variable of 2 is set.
"""


def ends_here() -> bool:
    """Whether discovery, as the environment has it, ends at this machine."""
    reach = os.environ.get(DISCOVERY_RANGE, RANGE)
    return reach == RANGE and not os.environ.get("ROS_STATIC_PEERS")


def fast_dds() -> int:
    """Return the major version of Fast DDS: 2 with rclpy 7 (ROS 2 Jazzy), 3 with later ones."""
    return 2 if int(version("rclpy").partition(".")[0]) <= 7 else 3


def prepare() -> None:
    """Set the environment for ``rclpy.init``; what the user has set stays.

    A drive obeys whoever it discovers, so it takes a user who sets
    ``ROS_AUTOMATIC_DISCOVERY_RANGE`` for others to come in. Frequent announcements are for this
    machine alone; no other host is sent them.
    """
    os.environ.setdefault(DISCOVERY_RANGE, RANGE)
    if ends_here() and not any(variable in os.environ for variable, _ in PROFILES.values()):
        variable, file = PROFILES[fast_dds()]
        os.environ[variable] = str(file)

"""Discovery of our nodes: limited to this machine, and fast, unless the user has set otherwise."""

import os
from importlib.metadata import version
from pathlib import Path

DISCOVERY_RANGE, RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
"""ROS's variable for the discovery range, and our value unless the user has set it."""
PROFILES = {
    2: ("FASTRTPS_DEFAULT_PROFILES_FILE", Path(__file__).with_name("discovery_fast_dds_2.xml")),
    3: ("FASTDDS_DEFAULT_PROFILES_FILE", Path(__file__).with_suffix(".xml")),
}
"""Environment variable and profile file for each major version of Fast DDS.

The profiles set how Fast DDS announces us to this machine, and how soon it repeats lost messages.
Fast DDS 2 refuses the file for 3. With 3, rmw_fastrtps warns if the variable of 2 is set.
"""


def ends_here() -> bool:
    """Return whether the environment limits discovery to this machine."""
    reach = os.environ.get(DISCOVERY_RANGE, RANGE)
    return reach == RANGE and not os.environ.get("ROS_STATIC_PEERS")


def fast_dds() -> int:
    """Return the major version of Fast DDS: 2 with rclpy 7 (ROS 2 Jazzy), 3 with later ones."""
    return 2 if int(version("rclpy").partition(".")[0]) <= 7 else 3


def prepare() -> None:
    """Set the environment for ``rclpy.init``; settings of the user are kept.

    A drive obeys every publisher that it discovers. Only users who set
    ``ROS_AUTOMATIC_DISCOVERY_RANGE`` let other hosts in. Frequent announcements are sent to this
    machine only.
    """
    os.environ.setdefault(DISCOVERY_RANGE, RANGE)
    if ends_here() and not any(variable in os.environ for variable, _ in PROFILES.values()):
        variable, file = PROFILES[fast_dds()]
        os.environ[variable] = str(file)

"""Discovery of our nodes: limited to this machine, and fast, unless the user has set otherwise."""

import os
from importlib.metadata import distributions, version
from pathlib import Path

DISCOVERY_RANGE, RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
"""ROS's variable for the discovery range, and our value unless the user has set it."""
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
"""Fast DDS's variable for its transports; rmw_fastrtps sets its own ones for LOCALHOST."""
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


def has_udp_only() -> bool:
    """Return whether the user chose UDP and a range in which ROS uses the choice."""
    return not ends_here() and os.environ.get(TRANSPORTS, "").startswith("UDP")


def unused_transports() -> str:
    """Return a warning if ROS does not use the user's choice of transports, else an empty text."""
    if not (chosen := os.environ.get(TRANSPORTS)) or not ends_here():
        return ""
    return (
        f"{TRANSPORTS} = {chosen}: ROS does not use it while {DISCOVERY_RANGE} is {RANGE}, "
        f"the default here; set {DISCOVERY_RANGE}=SUBNET, too (other hosts are heard then)"
    )


def fast_dds() -> int:
    """Return the major version of Fast DDS: 2 with rclpy 7 (ROS 2 Jazzy), 3 with later ones."""
    return 2 if int(version("rclpy").partition(".")[0]) <= 7 else 3


def from_pypi() -> bool:
    """Return whether Fast DDS is one from PyPI, which lacks SROS 2."""
    return any(
        distribution.name in ("ros-fastdds", "ros-fastrtps") for distribution in distributions()
    )


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

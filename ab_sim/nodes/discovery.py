"""Settings of DDS discovery: on this machine only, and fast, unless the user has set others."""

import os
from importlib.metadata import distributions, version
from pathlib import Path

DISCOVERY_RANGE, RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
"""Environment variable of ROS for the discovery range, and its value if the user has set none."""
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
"""Environment variable of Fast DDS for its transports; with LOCALHOST, rmw_fastrtps sets others."""
PROFILES = {
    2: ("FASTRTPS_DEFAULT_PROFILES_FILE", Path(__file__).with_name("discovery_fast_dds_2.xml")),
    3: ("FASTDDS_DEFAULT_PROFILES_FILE", Path(__file__).with_suffix(".xml")),
}
"""Environment variable and profile file for each major version of Fast DDS.

The profiles set how often Fast DDS announces this process on this machine, and how soon it repeats
lost messages. Version 2 refuses the file for version 3. With version 3, rmw_fastrtps warns if the
variable of version 2 is set.
"""


def ends_here() -> bool:
    """Return whether the environment limits discovery to this machine."""
    reach = os.environ.get(DISCOVERY_RANGE, RANGE)
    return reach == RANGE and not os.environ.get("ROS_STATIC_PEERS")


def has_udp_only() -> bool:
    """Return whether the user chose UDP, and a discovery range in which ROS uses this choice."""
    return not ends_here() and os.environ.get(TRANSPORTS, "").startswith("UDP")


def unused_transports() -> str:
    """Return a warning if ROS does not use the user's choice of transports, else an empty text."""
    if not (chosen := os.environ.get(TRANSPORTS)) or not ends_here():
        return ""
    return (
        f"{TRANSPORTS} = {chosen}: ROS does not use it while {DISCOVERY_RANGE} is {RANGE}, "
        f"the default here; set {DISCOVERY_RANGE}=SUBNET, too (then other hosts can send commands)"
    )


def fast_dds() -> int:
    """Return the major version of Fast DDS: 2 with rclpy 7 (ROS 2 Jazzy), 3 with later ones."""
    return 2 if int(version("rclpy").partition(".")[0]) <= 7 else 3


def from_pypi() -> bool:
    """Return whether Fast DDS was installed from PyPI, and so lacks SROS 2."""
    return any(
        distribution.name in ("ros-fastdds", "ros-fastrtps") for distribution in distributions()
    )


def prepare() -> None:
    """Set the environment variables of discovery for ``rclpy.init``; keep settings of the user.

    A drive obeys every publisher that it discovers, so by default it discovers this machine only;
    the user can set ``ROS_AUTOMATIC_DISCOVERY_RANGE``. The frequent announcements of the profiles
    are not used on a network.
    """
    os.environ.setdefault(DISCOVERY_RANGE, RANGE)
    if ends_here() and not any(variable in os.environ for variable, _ in PROFILES.values()):
        variable, file = PROFILES[fast_dds()]
        os.environ[variable] = str(file)

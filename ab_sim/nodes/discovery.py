"""Settings of DDS discovery, and the participants on this machine.

Discovery is limited to this machine and fast, unless the user has set others.
"""

import os
import pwd
import time
from importlib.metadata import distributions, version
from pathlib import Path

DISCOVERY_RANGE, RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
"""ROS's environment variable for the discovery range, and the value used if it is not set."""
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
"""Fast DDS's environment variable for transports; rmw_fastrtps ignores it with LOCALHOST."""
PROFILES = {
    2: ("FASTRTPS_DEFAULT_PROFILES_FILE", Path(__file__).with_name("discovery_fast_dds_2.xml")),
    3: ("FASTDDS_DEFAULT_PROFILES_FILE", Path(__file__).with_suffix(".xml")),
}
"""Environment variable and profile file for each major version of Fast DDS.

The profiles set how often Fast DDS announces this process on this machine, and how soon it repeats
lost messages. Version 2 refuses the file for version 3. With version 3, rmw_fastrtps warns if the
variable of version 2 is set.
"""


def _ends_here() -> bool:
    """Return whether the environment limits discovery to this machine."""
    reach = os.environ.get(DISCOVERY_RANGE, RANGE)
    return reach == RANGE and not os.environ.get("ROS_STATIC_PEERS")


def _has_udp_only() -> bool:
    """Return whether the user chose UDP as transport, and the discovery range permits that."""
    return not _ends_here() and os.environ.get(TRANSPORTS, "").startswith("UDP")


def unused_transports() -> str:
    """Return a warning if ROS does not use the user's choice of transports, else an empty text."""
    if not (chosen := os.environ.get(TRANSPORTS)) or not _ends_here():
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
    if _ends_here() and not any(variable in os.environ for variable, _ in PROFILES.values()):
        variable, file = PROFILES[fast_dds()]
        os.environ[variable] = str(file)


# DDSI-RTPS specification, 9.6.2: the port for unicast discovery of a participant is BASE
# + PER_DOMAIN domain + FIRST + PER_PARTICIPANT participant.
BASE, PER_DOMAIN, FIRST, _PER_PARTICIPANT = 7400, 250, 10, 2
_SOCKETS = (Path("/proc/net/udp"), Path("/proc/net/udp6"))
"""Socket tables of the system."""
MEMORY = Path("/dev/shm")
"""Folder of the files of shared memory."""
_FILLED = 2.0
"""Age at which Fast DDS has written a new file of shared memory [s]."""
_READS = 5
"""Number of reads of each socket table. The system writes the tables page by page, so that a read
may miss sockets while others open or close. With three busy programs, 83 of 1,000 reads missed some
of 100 sockets; none of 1,000 groups of five reads did."""


def participants_here() -> int | None:
    """Return the number of DDS participants on this domain, this process's included; None: unknown.

    Each participant on this machine has a port that the DDSI specification determines. The number
    is known only if discovery is limited to this machine.
    """
    if not _ends_here():
        return None
    sockets = _sockets()
    return None if sockets is None else len(sockets)


def unheard_users() -> str:
    """Return a warning if other users' DDS participants are on this domain, else an empty text.

    These participants discover each other over UDP, but exchange no data, because data pass
    through shared memory, which belongs to one user.
    """
    if _has_udp_only():
        return ""
    users = sorted({_name(user) for user in (_sockets() or {}).values() if user != os.getuid()})
    if not users:
        return ""
    return (
        f"programs of {', '.join(users)} are on ROS_DOMAIN_ID {_domain()}, and this one is of "
        f"{_name(os.getuid())}: they exchange no data, because Fast DDS's shared memory belongs to "
        "one user; run them as one user, or each with "
        f"{DISCOVERY_RANGE}=SUBNET {TRANSPORTS}=UDPv4"
    )


def stuck_ports() -> str:
    """Return a warning if empty files block Fast DDS's shared memory, else an empty text.

    A process that is killed while it creates a file of a port leaves the file empty. Each new
    participant on the domain then waits for its content.
    """
    begin = BASE + PER_DOMAIN * _domain()
    ports = range(begin, begin + PER_DOMAIN)
    stuck = [
        str(file)
        for port in ports
        for file in (MEMORY / f"fastdds_port{port}", MEMORY / f"fastrtps_port{port}")
        if _stays_empty(file)
    ]
    if not stuck:
        return ""
    return (
        f"{' '.join(stuck)}: empty, left by a process that was killed; programs that start on "
        f"ROS_DOMAIN_ID {_domain()} may wait forever. End all programs of this domain, remove "
        f"the file by `rm {' '.join(stuck)}`, and start them again; or use another domain"
    )


def _stays_empty(file: Path) -> bool:
    """Return whether a file remains empty for longer than Fast DDS takes to fill a new one."""
    try:
        status = file.stat()
        if status.st_size == 0:
            time.sleep(min(max(status.st_mtime + _FILLED - time.time(), 0.0), _FILLED))
            status = file.stat()
    except OSError:
        return False
    return status.st_size == 0


def _domain() -> int:
    """Return the DDS domain id of this process, from ``ROS_DOMAIN_ID``."""
    return int(os.environ.get("ROS_DOMAIN_ID") or 0)


def _name(user: int) -> str:
    """Return a user's name for messages; without a name, the user id."""
    try:
        return f"user {pwd.getpwuid(user).pw_name}"
    except KeyError:
        return f"user {user}"


def _sockets() -> dict[int, int] | None:
    """Return the user id of each DDS participant on this domain, by UDP port; None if unknown."""
    try:
        first = BASE + PER_DOMAIN * _domain() + FIRST
        files = [file for file in _SOCKETS if file.exists()]
        tables = [file.read_text(encoding="utf-8") for file in files for _ in range(_READS)]
    except (OSError, ValueError):
        return None
    bound = dict(_socket(line) for table in tables for line in table.splitlines()[1:])
    last = first + PER_DOMAIN - FIRST
    ports = range(first, last, _PER_PARTICIPANT)
    return {port: bound[port] for port in ports if port in bound} if tables else None


def _socket(line: str) -> tuple[int, int]:
    """Return port and user id from a line of a socket table."""
    words = line.split()
    return int(words[1].rpartition(":")[2], 16), int(words[7])

"""Who can find a node: this machine, unless the user has said otherwise."""

import contextlib
import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from ab_sim.nodes import discovery
from tests.nodes.two_hosts import TwoHosts

pytest.importorskip("rclpy", reason="needs ROS 2")
pytestmark = pytest.mark.ros

# Prints whose nodes it has found, with each new one.
LOOK = """
import rclpy
rclpy.init()
node = rclpy.create_node("looking")
found = set()
while True:
    new = {name for name, _ in node.get_node_names_and_namespaces()} - found
    if new:
        found |= new
        print(*sorted(found), flush=True)
    rclpy.spin_once(node, timeout_sec=0.05)
"""
# As `ros2 node list --no-daemon` and `ros2 topic list --no-daemon` do, again and again: in ROS's
# default range, with a participant of its own for half a second.
LIST = """
import rclpy, time
while True:
    rclpy.init()
    node = rclpy.create_node("_ros2cli")
    end = time.monotonic() + 0.5
    while (left := end - time.monotonic()) > 0.0:
        rclpy.spin_once(node, timeout_sec=left)
    names = [name for name, _ in node.get_node_names_and_namespaces()]
    topics = [name for name, _ in node.get_topic_names_and_types()]
    print("listed", *names, *topics, flush=True)
    node.destroy_node()
    rclpy.shutdown()
"""
# Says something five times as a node does; prints of each whether it was soon acknowledged.
SPEAK = """
import rclpy
from rclpy.duration import Duration
from ab_msgs_py import topics
from ab_sim.nodes.process import init_ros
init_ros()
node = rclpy.create_node("speaking")
publisher = topics.COMMAND.publisher(node)
while not publisher.get_subscription_count():
    rclpy.spin_once(node, timeout_sec=0.05)
soon = []
for speed in range(5):
    publisher.publish(topics.COMMAND.message(speed))
    soon.append(publisher.wait_for_all_acked(Duration(seconds=2.0)))
print("acknowledged", *soon, flush=True)
"""
LISTEN = """
import rclpy
from ab_msgs_py import topics
rclpy.init()
node = rclpy.create_node("listening")
topics.COMMAND.subscription(node, print)
rclpy.spin(node)
"""
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PEERS = "ROS_STATIC_PEERS"


class Started:
    """Processes of a test, ended by closing what they belong to."""

    def __init__(self, domain: int) -> None:
        self._domain = domain
        self._processes: list[subprocess.Popen[str]] = []

    def __call__(
        self, where: list[str], *command: str, reach: str | None = None
    ) -> subprocess.Popen[str]:
        """Start Python somewhere; what it prints can be read line by line."""
        # of a node that this process has been
        ours = {RANGE, *(variable for variable, _ in discovery.PROFILES.values())}
        environment = {k: v for k, v in os.environ.items() if k not in ours}
        environment |= {"ROS_DOMAIN_ID": str(self._domain), "PYTHONUNBUFFERED": "1"}
        if reach is not None:
            environment[RANGE] = reach
        process = subprocess.Popen(
            [*where, sys.executable, *command],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=Path(__file__).parents[2],
        )
        self._processes.append(process)
        return process

    def close(self) -> None:
        for process in self._processes:
            process.kill()
            process.communicate()


def until(process: subprocess.Popen[str], name: str) -> list[str]:
    """Wait until who looks has found a name; all that it has found, nothing if it is too late."""
    assert process.stdout is not None
    end, said = time.monotonic() + 120.0, b""
    while (left := end - time.monotonic()) > 0.0:
        if select.select([process.stdout], [], [], left)[0]:
            more = os.read(process.stdout.fileno(), 4096)
            assert more, f"it ended without {name!r}: {said.decode()}"
            said += more
        whole, _, _ = said.decode().rpartition("\n")
        for line in whole.splitlines():
            if name in line.split():
                return line.split()
    return []


def in_a_row(process: subprocess.Popen[str], names: set[str], times: int) -> bool:
    """Wait until so many lists in a row have all names; False if it is too late."""
    assert process.stdout is not None
    end, row = time.monotonic() + 120.0, 0
    while row < times and time.monotonic() < end:
        line = process.stdout.readline()
        assert line, "it ended"
        row = row + 1 if names <= set(line.split()) else 0
    return row == times


@pytest.fixture
def started(domain: int) -> Iterator[Started]:
    made = Started(domain)
    yield made
    made.close()


@pytest.fixture
def hosts() -> Iterator[TwoHosts]:
    with contextlib.ExitStack() as made:
        try:
            two = made.enter_context(TwoHosts())
        except OSError as error:
            pytest.skip(str(error))
        yield two


@pytest.mark.timeout(300)
def test_another_host_finds_only_who_wants_to_be_found(hosts: TwoHosts, started: Started) -> None:
    """Two nodes on one host, the second with the user's own range; who looks is on another host."""
    node = ("-m", "ab_sim.nodes.profile_controller", "--ros-args", "-r")
    near = started(hosts.on("a"), "-c", LOOK)
    far = started(hosts.on("b"), "-c", LOOK)
    started(hosts.on("a"), *node, "__node:=closed")
    assert until(near, "closed")
    started(hosts.on("a"), *node, "__node:=open", reach="SUBNET")
    found = until(far, "open")
    assert found, "who wants to be found was not"
    assert "closed" not in found


@pytest.mark.timeout(300)
def test_the_ros2_command_line_finds_a_drive_at_once(started: Started) -> None:
    """Each time: who is announced every 3 s is found once, and not by the next lists."""
    drive = ("-m", "ab_sim.nodes.drive_sim", "--ros-args", "-p", "autostart:=false")
    started([], *drive)
    lists = started([], "-c", LIST)
    assert in_a_row(lists, {"drive_sim", "/drive_sim/transition_event"}, 4)


def test_what_is_said_is_acknowledged_soon(started: Started) -> None:
    """A node that ends waits for that; with Fast DDS's own period it would take up to 3 s."""
    started([], "-c", LISTEN)
    speaker = started([], "-c", SPEAK)
    assert until(speaker, "acknowledged") == ["acknowledged", *["True"] * 5]


@pytest.mark.parametrize(
    ("given", "often"),
    [
        ({}, True),
        ({RANGE: "LOCALHOST"}, True),
        ({RANGE: "SUBNET"}, False),
        ({PEERS: "10.99.0.2"}, False),
    ],
)
def test_only_this_machine_is_told_often(
    monkeypatch: pytest.MonkeyPatch, given: dict[str, str], often: bool
) -> None:
    monkeypatch.setattr(os, "environ", dict(given))
    discovery.prepare()
    variable, file = discovery.PROFILES[discovery.fast_dds()]
    wanted = {variable: str(file)} if often else {}
    assert os.environ == {RANGE: "LOCALHOST"} | given | wanted


@pytest.mark.parametrize("variable", [variable for variable, _ in discovery.PROFILES.values()])
def test_profiles_of_the_user_stay(monkeypatch: pytest.MonkeyPatch, variable: str) -> None:
    monkeypatch.setattr(os, "environ", {variable: "mine"})
    discovery.prepare()
    assert os.environ == {RANGE: "LOCALHOST", variable: "mine"}


def test_both_versions_of_fast_dds_have_the_same_profiles() -> None:
    (_, two), (_, three) = discovery.PROFILES.values()
    trees = [ElementTree.fromstring(file.read_text()) for file in (two, three)]
    in_two, in_three = (ElementTree.tostring(tree, encoding="unicode") for tree in trees)
    assert in_two.replace("heartbeatPeriod", "heartbeat_period") == in_three

"""How many participants this machine has: real ones, on a domain of their own."""

import os
import socket

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

import rclpy  # noqa: E402
from rclpy.context import Context  # noqa: E402

from ab_sim.nodes.discovery import (  # noqa: E402
    DISCOVERY_RANGE,
    RANGE,
    TRANSPORTS,
    unused_transports,
)
from ab_sim.nodes.participants import (  # noqa: E402
    BASE,
    FIRST,
    PER_DOMAIN,
    participants_here,
    unheard_users,
)
from tests.cli.tool import ab_sim  # noqa: E402
from tests.domains import own_domain  # noqa: E402

pytestmark = pytest.mark.ros


def test_each_counts_from_its_first_node_on(monkeypatch: pytest.MonkeyPatch) -> None:
    with own_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        monkeypatch.setenv(DISCOVERY_RANGE, RANGE)
        monkeypatch.delenv("ROS_STATIC_PEERS", raising=False)
        assert participants_here() == 0
        contexts, nodes = [Context(), Context()], []
        for number, context in enumerate(contexts, start=1):
            rclpy.init(context=context, args=[])
            nodes += [rclpy.create_node(name, context=context) for name in ("one", "two")]
            assert participants_here() == number
        monkeypatch.setenv("ROS_STATIC_PEERS", "192.0.2.1")
        assert participants_here() is None, "others may be elsewhere"
        monkeypatch.delenv("ROS_STATIC_PEERS")
        monkeypatch.setenv(DISCOVERY_RANGE, "SUBNET")
        assert participants_here() is None
        for node in nodes:
            node.destroy_node()
        for context in contexts:
            context.try_shutdown()


@pytest.mark.skipif(os.getuid() != 0, reason="only root may become another user")
def test_users_that_are_not_heard_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fast DDS's shared memory keeps users apart: a port of another user is one of them."""
    with own_domain() as domain, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        monkeypatch.delenv(DISCOVERY_RANGE, raising=False)
        monkeypatch.delenv(TRANSPORTS, raising=False)
        assert unheard_users() == ""
        os.fchown(port.fileno(), 12345, 12345)
        port.bind(("127.0.0.1", BASE + PER_DOMAIN * domain + FIRST))
        assert f"programs of user 12345 are on ROS_DOMAIN_ID {domain}, and" in unheard_users()
        monkeypatch.setenv(TRANSPORTS, "UDPv4")
        assert "12345" in unheard_users(), "with LOCALHOST, ROS does not use it"
        monkeypatch.setenv(DISCOVERY_RANGE, "SUBNET")
        assert unheard_users() == ""


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("ROS_DOMAIN_ID", "400", "ROS_DOMAIN_ID = '400': must be a whole number from 0 to 232"),
        ("ROS_DOMAIN_ID", "x", "ROS_DOMAIN_ID = 'x': must be"),
        (
            "ROS_SECURITY_ENABLE",
            "true",
            "ROS_SECURITY_ENABLE = 'true': the Fast DDS from PyPI has no",
        ),
        ("ROS_LOG_DIR", "/proc/none", "ROS cannot write its log: "),
        ("HOME", None, "set ROS_LOG_DIR to a folder"),
    ],
)
@pytest.mark.parametrize("command", [["live", "no-ball", "--for", "0.1"], ["node", "list"]])
def test_what_is_wrong_around_is_blamed(
    monkeypatch: pytest.MonkeyPatch,
    command: list[str],
    variable: str,
    value: str | None,
    words: str,
) -> None:
    with own_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        if value is None:
            monkeypatch.delenv(variable)
            monkeypatch.delenv("ROS_LOG_DIR", raising=False)
        else:
            monkeypatch.setenv(variable, value)
        done = ab_sim(*command)
    assert done.returncode == 2 and words in done.stderr, done.stderr
    assert "Traceback" not in done.stderr and "argument" not in done.stderr


def test_transports_that_ros_does_not_use_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(DISCOVERY_RANGE, raising=False)
    monkeypatch.setenv(TRANSPORTS, "UDPv4")
    assert f"set {DISCOVERY_RANGE}=SUBNET, too" in unused_transports()
    monkeypatch.setenv(DISCOVERY_RANGE, "SUBNET")
    assert unused_transports() == ""

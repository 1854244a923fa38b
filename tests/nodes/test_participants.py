"""How many participants this machine has: real ones, on a domain of their own."""

import os
import socket
import threading
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

import rclpy  # noqa: E402
from rclpy.context import Context  # noqa: E402

from ab_sim.nodes.discovery import (  # noqa: E402  # noqa: E402
    BASE,
    DISCOVERY_RANGE,
    FIRST,
    PER_DOMAIN,
    RANGE,
    TRANSPORTS,
    participants_here,
    stuck_ports,
    unheard_users,
    unused_transports,
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
        ("ROS_DOMAIN_ID", "400", "ROS_DOMAIN_ID = '400': "),
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


def test_a_file_on_which_fast_dds_waits_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A file of another domain, one with content and one that is being made are in order."""
    monkeypatch.setattr("ab_sim.nodes.discovery.MEMORY", tmp_path)
    monkeypatch.setenv("ROS_DOMAIN_ID", "17")
    for name, content in (("port7400", ""), ("port11662_el", ""), ("port11662", "x")):
        (tmp_path / f"fastdds_{name}").write_text(content)
        os.utime(tmp_path / f"fastdds_{name}", (0, 0))
    stuck = tmp_path / "fastdds_port11663"
    stuck.touch()
    filled = threading.Timer(0.2, stuck.write_text, ["x"])
    filled.start()
    assert stuck_ports() == "", "it is being made"
    filled.join()
    stuck.write_text("")  # a moment ago: a program that starts now would wait
    assert f"remove the file by `rm {stuck}`" in stuck_ports()


def test_node_list_names_such_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """For a port that only the 100th participant would take, so that nobody waits here."""
    with own_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        stuck = Path(f"/dev/shm/fastdds_port{BASE + PER_DOMAIN * domain + 249}")
        stuck.touch()
        os.utime(stuck, (0, 0))
        try:
            done = ab_sim("node", "list", "--wait", "0.5")
        finally:
            stuck.unlink(missing_ok=True)
    assert f"{stuck}: empty, " in done.stderr

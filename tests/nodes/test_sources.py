"""Who commands, by DDS's list of publishers and by who has sent."""

import signal
import sys
from pathlib import Path

import pytest

from ab_sim.nodes.commands import CommandSources, Endpoint

COMMAND, TRAJECTORY = "spindle/command", "spindle/trajectory"


def publisher(
    process: int, topic: str = COMMAND, node: str = "/firmware", own: int = 3
) -> Endpoint:
    """A publisher of a process, which is a participant of DDS."""
    return Endpoint(topic, node, bytes([process] * 12 + [0, 0, own, 3]))


RESTARTED = [publisher(process) for process in range(6)]
BOTH = [publisher(1), publisher(1, TRAJECTORY, own=4)]
TWO = [publisher(1), publisher(2, node="/joystick")]
TWINS = [publisher(1), publisher(2)]


@pytest.mark.parametrize(
    ("endpoints", "heard", "lately", "sources"),
    [
        ([], [], [], CommandSources(0, 0)),
        (RESTARTED, RESTARTED, RESTARTED[-1:], CommandSources(1, 5)),
        (RESTARTED[:1], RESTARTED[:1], [], CommandSources(1, 1)),
        (RESTARTED[:1], [], [], CommandSources(1, 0)),
        (BOTH, BOTH[:1], BOTH[:1], CommandSources(1, 0)),
        (TWO, TWO, TWO, CommandSources(2, 0)),
        (TWO, TWO, TWO[:1], CommandSources(2, 1)),
        (TWINS, TWINS, TWINS, CommandSources(2, 0)),
        ([publisher(1), publisher(1, own=4)], [], [], CommandSources(2, 0)),
    ],
    ids=[
        *("nobody", "restarted five times", "dead or holding", "has not sent yet"),
        *("one on two topics", "two", "two, one silent", "two of one name", "two of one process"),
    ],
)
def test_sources(
    endpoints: list[Endpoint],
    heard: list[Endpoint],
    lately: list[Endpoint],
    sources: CommandSources,
) -> None:
    gids = {each.gid for each in heard}
    assert CommandSources.of(endpoints, gids, {each.gid for each in lately}) == sources


@pytest.mark.ros
def test_a_firmware_that_was_killed_and_started_again_is_one(fleet: "Fleet") -> None:  # noqa: F821
    """By DDS alone it is two for 20 s."""
    from ab_sim.nodes.discovery import fast_dds

    if fast_dds() < 3:
        pytest.skip("rclpy of Jazzy does not report who has sent a message")
    fleet.start("drive_sim")
    firmware = [sys.executable, str(Path(__file__).with_name("eager_firmware.py"))]

    def value(key: str) -> str:
        return str(fleet.value("drive_sim", key))

    for dead in range(2):
        process = fleet.start_process("firmware", *firmware)
        fleet.until(
            lambda n=dead: (
                value("sources of commands") == "1"
                and int(value("sources possibly dead")) >= n
                and value("command age [s]") != "none yet"
            ),
            "one commands, the others may be dead",
        )
        process.send_signal(signal.SIGKILL)
        process.wait()
        del fleet.processes["firmware"]

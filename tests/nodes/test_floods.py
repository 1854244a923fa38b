"""Floods of commands and of requests: whoever sends them, nobody else's command is lost."""

import math
from typing import Any

import numpy as np
import pytest
from std_srvs.srv import SetBool

from ab_msgs_py import Block, Qos, topics
from ab_msgs_py.samples import nanoseconds_of
from ab_msgs_py.services import switch_request
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros

STEP_NS = 1_000_000
FIRMWARE = topics.COMMAND._replace(qos=Qos(10))
"""As somebody publishes who knows nothing of floods: with ROS's usual depth."""


def commands_of(blocks: list[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Steps from which a command acted, and the commands."""
    samples = np.concatenate([Block.of(message).samples for message in blocks])
    commands = samples[:, Block.of(blocks[0]).channels.index("command")]
    begins = 1 + np.flatnonzero(np.diff(commands))
    return samples[begins, 0], commands[begins]


def test_a_flood_is_counted_whole_and_delays_no_good_command(fleet: Fleet) -> None:
    """5 kHz of NaN, paced by the drive's own clock, with a good command now and then."""
    deep = Qos(20_000)
    blocks, clock = fleet.listen(topics.BLOCK), fleet.listen(topics.CLOCK._replace(qos=deep))
    sent: dict[float, int] = {}
    bad = 0

    def flood(message: Any) -> None:
        nonlocal bad
        if len(sent) < 50:
            if bad % 200 == 0:
                speed = 1.0 + len(sent)
                sent[speed] = nanoseconds_of(message.clock)
                good.publish(topics.COMMAND.message(speed))
            for _ in range(20):
                flooding.publish(topics.COMMAND.message(math.nan))
            bad += 20

    flooding, good = topics.COMMAND.publisher(fleet.node), FIRMWARE.publisher(fleet.node)
    fleet.start("drive_sim", scene="thesis-hold")
    for publisher in (flooding, good):
        fleet.until(publisher.get_subscription_count, "the drive listens")
    # Only the newest: on a busy machine this process lags behind the clock, not the drive.
    topics.CLOCK._replace(qos=Qos(1)).subscription(fleet.node, flood)
    fleet.until(lambda: fleet.value("drive_sim", "commands accepted") == "50", "50 good commands")
    fleet.until(
        lambda: fleet.value("drive_sim", "commands rejected") == str(bad), f"{bad} are counted"
    )
    assert bad > 9_800
    assert fleet.stop("drive_sim") == 0
    assert fleet.log("drive_sim").count("rejected") < 100, "one line for many"
    steps, acted = commands_of(blocks)
    # Of those that came between two wake-ups the last one acts.
    assert len(acted) > 40 and np.all(np.diff(acted) > 0), "in order"
    ticks = np.array([nanoseconds_of(message.clock) for message in clock])
    delays = [
        1 + int(np.sum((ticks > sent[speed]) & (ticks < step * STEP_NS)))
        for step, speed in zip(steps, acted, strict=True)
    ]
    # A busy machine may stop one of the two processes at any time, and not the other.
    assert np.median(delays) <= 2, f"wake-ups: {delays}"


def test_a_flood_between_two_wake_ups_evicts_nobody_elses_command(fleet: Fleet) -> None:
    """One wake-up a second: long enough for 1500 bad commands to come after the good one."""
    blocks = fleet.listen(topics.BLOCK)
    flooding, good = topics.COMMAND.publisher(fleet.node), FIRMWARE.publisher(fleet.node)
    fleet.start("drive_sim", scene="thesis-hold", wake_rate=1.0, block_rate=1.0, patience=10.0)
    for publisher in (flooding, good):
        fleet.until(publisher.get_subscription_count, "the drive listens")
    # A change shows in blocks only to who has heard what was before. That a publisher has found the
    # drive does not say that the drive has found it: of two, one may be a wake-up later.
    fleet.until(lambda: len(blocks) > 3, "blocks")
    for count in range(1, 5):
        good.publish(topics.COMMAND.message(float(count)))
        for _ in range(1500):
            flooding.publish(topics.COMMAND.message(math.nan))
        fleet.until(
            lambda n=count: fleet.value("drive_sim", "commands rejected") == str(1500 * n),
            f"{1500 * count} are counted",
        )
        # The good one may arrive later: it has a publisher of its own.
        fleet.until(
            lambda n=count: fleet.value("drive_sim", "commands accepted") == str(n),
            f"{count} are accepted",
        )
    assert fleet.stop("drive_sim") == 0
    assert commands_of(blocks)[1].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_a_flood_of_requests_costs_no_command(fleet: Fleet) -> None:
    """Each asks to resume what is running, as fast as one can ask."""
    blocks = fleet.listen(topics.BLOCK)
    good = FIRMWARE.publisher(fleet.node)
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.until(good.get_subscription_count, "the drive listens")
    client = fleet.node.create_client(SetBool, "drive_sim/pause")
    fleet.until(client.service_is_ready, "the service")
    answers = []
    for count in range(1, 51):
        good.publish(topics.COMMAND.message(float(count)))
        for _ in range(200):
            client.call_async(switch_request(False)).add_done_callback(answers.append)
        heard = len(blocks)
        fleet.until(lambda heard=heard: len(blocks) > heard, "another block")
    fleet.until(lambda: fleet.value("drive_sim", "commands accepted") == "50", "50 good commands")
    assert answers, "some of so many requests are answered"
    assert fleet.call("drive_sim/pause", True)[0], "and whoever asks again is heard"
    assert fleet.stop("drive_sim") == 0
    acted = commands_of(blocks)[1]
    # Of those that came between two wake-ups the last one acts.
    assert len(acted) > 40 and np.all(np.diff(acted) > 0), "in order"

"""What a flood of bad commands does to good ones.

    python benchmarks/command_floods.py [--rate 5000] [--commands 50]

starts drive_sim, and a process that publishes so many NaN commands a second (0: as fast as it can);
publishes a good command ten times a second; and prints how many wake-ups after each had been
published it acted, by the clock on the wall, what was counted, and how many steps were dropped. A
drive that drops steps falls behind the wall's clock, and delays then mean nothing.
"""

import argparse
import contextlib
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.impl.implementation_singleton import rclpy_implementation  # noqa: E402

from ab_msgs_py import Block, Health, topics  # noqa: E402
from ab_msgs_py.samples import nanoseconds_of  # noqa: E402

STEP, WAKE = 1e-3, 4e-3
"""s, of the drive."""
NODE = [sys.executable, "-m", "ab_sim.nodes.drive_sim", "--ros-args", "-p", "scene:=thesis-hold"]
RCLError = rclpy_implementation.RCLError
COUNTED = ("commands accepted", "commands rejected", "steps dropped", "real-time factor")


def flood(rate: float, stop: Event, sent: Any) -> None:
    """Publish bad commands until told to stop."""
    rclpy.init()
    publisher = topics.COMMAND.publisher(rclpy.create_node("flood"))
    message, begin = topics.COMMAND.message(math.nan), time.monotonic()
    while not stop.is_set():
        due = int((time.monotonic() - begin) * rate) - sent.value if rate else 100
        # Nobody takes so many: then DDS refuses for a while.
        with contextlib.suppress(RCLError):
            for _ in range(due):
                publisher.publish(message)
                sent.value += 1
        if rate:
            time.sleep(1e-3)


class Bench:
    """Commands the drive, and keeps what it publishes."""

    def __init__(self) -> None:
        node = rclpy.create_node("command_floods")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self.commands = topics.COMMAND.publisher(node)
        self.blocks: list[Any] = []
        self.values: dict[str, str] = {}
        self.behind = math.inf
        topics.BLOCK.subscription(node, self.blocks.append)
        topics.CLOCK.subscription(node, self._tick)
        topics.DIAGNOSTICS.subscription(node, self._hear)

    def spin(self, seconds: float) -> None:
        """Hear what comes."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def _tick(self, message: Any) -> None:
        """The least that the simulated time is behind the wall's."""
        here = time.monotonic() - 1e-9 * nanoseconds_of(message.clock)
        self.behind = min(self.behind, here)

    def _hear(self, message: Any) -> None:
        for health in Health.all_of(message):
            if health.node == "/drive_sim":
                self.values = health.values

    def acted(self) -> dict[float, float]:
        """When each command acted [s, simulated]."""
        samples = np.concatenate([Block.of(message).samples for message in self.blocks])
        commands = samples[:, Block.of(self.blocks[0]).channels.index("command")]
        begins = 1 + np.flatnonzero(np.diff(commands))
        times = STEP * samples[begins, 0]
        return dict(zip(commands[begins].tolist(), times.tolist(), strict=True))


def measure(rate: float, count: int) -> None:
    """Run, print, and end what was started."""
    spawn = multiprocessing.get_context("spawn")
    stop, sent = spawn.Event(), spawn.Value("q", 0)
    other = spawn.Process(target=flood, args=(rate, stop, sent))
    drive = subprocess.Popen(NODE)
    try:
        bench = Bench()
        while not (bench.values and bench.commands.get_subscription_count()):
            bench.spin(0.1)
        bench.spin(3.0)
        behind = bench.behind
        other.start()
        while not sent.value:
            bench.spin(0.1)
        published = {}
        for k in range(count):
            bench.spin(0.1)
            published[1.0 + k] = time.monotonic()
            bench.commands.publish(topics.COMMAND.message(1.0 + k))
        bench.spin(2.0)
        stop.set()
        other.join()
        bench.spin(3.0)
        acted = bench.acted()
        late = sorted(
            (behind + acted[speed] - wall) / WAKE
            for speed, wall in published.items()
            if speed in acted
        )
        print(f"{sent.value} bad commands sent, {len(late)} of {count} good ones seen to act")
        print(f"wake-ups later: median {np.median(late):.1f}, latest {late[-1]:.1f}")
        print(", ".join(f"{name}: {bench.values[name]}" for name in COUNTED))
    finally:
        stop.set()
        drive.send_signal(signal.SIGINT)
        drive.wait()


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rate", type=float, default=5000.0, help="bad commands a second; 0: all")
    parser.add_argument("--commands", type=int, default=50, help="good commands")
    given = parser.parse_args()
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    measure(given.rate, given.commands)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()

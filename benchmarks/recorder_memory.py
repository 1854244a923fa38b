"""Memory of the recorder while a drive runs and commands flood in.

    python benchmarks/recorder_memory.py [--minutes 30] [--commands 1000]

starts drive_sim and recorder as processes, publishes so many commands a second, and prints, ten
times in all, how much memory the recorder has (resident set) and how much it has written; then by
how much that memory grew an hour, from the first fifth on. The recording, some 25 MB a minute, is
deleted.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402

from ab_msgs_py import Health, topics  # noqa: E402

PERIOD = 0.01
"""s between two bursts of commands."""
NODES = {
    "recorder": [],
    "drive_sim": ["-p", "scene:=thesis-hold", "-p", "wake_rate:=50", "-p", "error_checks:=0.0"],
}
ROWS = 10


class Watch:
    """Commands the drive and hears what the recorder says of itself."""

    def __init__(self) -> None:
        self.values: dict[str, str] = {}
        self.published = 0
        self._node = rclpy.create_node("recorder_memory")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._commands = topics.COMMAND.publisher(self._node)
        topics.DIAGNOSTICS.subscription(self._node, self._hear)

    def wait_for_drive(self) -> None:
        """Until the recorder records a drive, for at most five minutes."""
        end = time.monotonic() + 300.0
        while not self.values.get("file"):
            if time.monotonic() > end:
                sys.exit("the recorder has heard of no drive for 300 s")
            self._executor.spin_once(timeout_sec=0.1)

    def publish(self, seconds: float, rate: float) -> None:
        """So many commands a second, of speeds that change."""
        due, end = time.monotonic(), time.monotonic() + seconds
        while due < end:
            for _ in range(round(rate * PERIOD)):
                self.published += 1
                self._commands.publish(topics.COMMAND.message(100.0 + self.published % 7))
            due += PERIOD
            while (left := due - time.monotonic()) > 0:
                self._executor.spin_once(timeout_sec=left)

    def _hear(self, message: Any) -> None:
        for health in Health.all_of(message):
            if health.node == "/recorder":
                self.values = health.values


def resident(process: subprocess.Popen[bytes]) -> float:
    """Memory of a process [MB]."""
    pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def measure(folder: Path, minutes: float, rate: float) -> None:
    """Run, print, and end the nodes."""
    processes = {
        name: subprocess.Popen(
            [sys.executable, "-m", f"ab_sim.nodes.{name}", "--ros-args", *parameters,
             "--log-level", "warn"]
            + (["-p", f"path:={folder / 'run.rrd'}"] if name == "recorder" else []),
        )
        for name, parameters in NODES.items()
    }  # fmt: skip
    try:
        watch = Watch()
        watch.wait_for_drive()
        began, seen = time.monotonic(), []
        for _ in range(ROWS):
            watch.publish(60.0 * minutes / ROWS, rate)
            seen.append(((time.monotonic() - began) / 60.0, resident(processes["recorder"])))
            file = (folder / "run.rrd").stat().st_size / 1e6
            print(
                f"{seen[-1][0]:6.2f} min  {seen[-1][1]:7.1f} MB  {watch.published} commands, "
                f"{watch.values['samples written']} samples in {file:.0f} MB, "
                f"{watch.values['messages dropped']} messages dropped",
                flush=True,
            )
        times, sizes = np.array(seen[ROWS // 5 :]).T
        print(f"growth: {60.0 * np.polyfit(times, sizes, 1)[0]:.1f} MB an hour")
    finally:
        for process in processes.values():
            process.send_signal(signal.SIGINT)
        codes = {name: process.wait() for name, process in processes.items()}
    print(f"exit codes: {codes}")


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=30.0, help="how long to run")
    parser.add_argument("--commands", type=float, default=1000.0, help="commands a second")
    given = parser.parse_args()
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    with tempfile.TemporaryDirectory() as folder:
        measure(Path(folder), given.minutes, given.commands)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()

"""What the recorder does and costs at full rate: a drive at 1 kHz with samples at 10 kHz.

    python benchmarks/recorder.py [--seconds 600] [--rounds 3] [--out FILE.json]

Five balls, 1000 commands a second, a web viewer, and another client of that viewer, which stands
for a browser and keeps what it gets. Printed as JSON: samples lost, the recorder's share of a core,
its memory over time, how old the newest sample is that has reached the client; then the drive's
lateness in rounds of 10 s, by turns without and with the recorder, one drive throughout. The
recording, some 250 MB a minute, is deleted.
"""

import argparse
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rerun.chunk import RrdReader  # noqa: E402

from ab_msgs_py import Health, topics  # noqa: E402
from ab_msgs_py.samples import nanoseconds_of  # noqa: E402
from ab_sim.viewing.program import Program  # noqa: E402
from ab_sim.viewing.proxy import free_port  # noqa: E402

CHANGES = ["balls.count=5", "start.ball_angles=[0,1,2,3,4]", "solver.step=0.0001"]
DRIVE = {
    "scene": "thesis-hold",
    "changes": json.dumps(CHANGES),
    "wake_rate": "1000.0",
    "error_checks": "0.0",
}
COMMANDS = 1000.0
"""1/s."""
PERIOD = 0.01
"""s between two bursts of commands."""
LOOKS = 30
"""At memory and delay, over the whole time."""
ROUND = 10.0
"""s."""
HEAD, TAIL = 64, 200
"""Messages at the beginning and at the end of a stream that are read to find its newest sample."""


class Watch:
    """Commands the drive, hears when its clock comes, and what nodes say of themselves."""

    def __init__(self) -> None:
        self.values: dict[str, dict[str, str]] = {}
        self.clock: list[tuple[float, float]] = []  # wall [s], simulated [s]
        self._node = rclpy.create_node("recorder_benchmark")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._commands, self._published = topics.COMMAND.publisher(self._node), 0
        topics.DIAGNOSTICS.subscription(self._node, self._hear)
        topics.WHIRL.subscription(self._node, self._hear_drive)

    def until(self, condition: Any, what: str) -> None:
        """Listen until a condition is true."""
        end = time.monotonic() + 300.0
        while not condition():
            if time.monotonic() > end:
                sys.exit(f"not within 300 s: {what}")
            self._executor.spin_once(timeout_sec=0.1)

    def command(self, seconds: float) -> None:
        """Commands of speeds that change, for so long."""
        due, end = time.monotonic(), time.monotonic() + seconds
        while due < end:
            for _ in range(round(COMMANDS * PERIOD)):
                self._published += 1
                self._commands.publish(topics.COMMAND.message(100.0 + self._published % 7))
            due += PERIOD
            while (left := due - time.monotonic()) > 0:
                self._executor.spin_once(timeout_sec=left)

    def _hear(self, message: Any) -> None:
        for health in Health.all_of(message):
            self.values[health.node.lstrip("/")] = health.values

    def _hear_drive(self, message: Any) -> None:
        self.clock.append((time.monotonic(), nanoseconds_of(message.header.stamp) * 1e-9))


class Client:
    """Of a viewer; what it gets goes to a file."""

    def __init__(self, url: str, path: Path) -> None:
        self._program, self._path = Program(), path
        arguments = ["--bind", "127.0.0.1", "--port", str(free_port()), "--save", str(path), url]
        self._started = self._program.start(arguments, tied=True, screen=False)
        self._places: list[int] = []  # where messages begin
        self._end = 12  # of the stream's own head

    def newest(self) -> float | None:
        """Time [s] of the newest sample that has come."""
        if not self._path.exists():
            return None
        with self._path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            while self._end + 16 <= size:
                file.seek(self._end)
                length = struct.unpack("<QQ", file.read(16))[1]
                if self._end + 16 + length > size:
                    break
                self._places.append(self._end)
                self._end += 16 + length
            if len(self._places) <= HEAD + TAIL:
                return None
            file.seek(0)
            part = file.read(self._places[HEAD])
            file.seek(self._places[-TAIL])
            part += file.read(self._end - self._places[-TAIL])
        with tempfile.NamedTemporaryFile(suffix=".rrd") as copy:
            copy.write(part)
            copy.flush()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # it warns of every file without an index
                chunks = RrdReader(copy.name).stream().to_chunks()
        times = [
            chunk.to_record_batch()["sim_time"].to_numpy(zero_copy_only=False).astype(float).max()
            for chunk in chunks
            if chunk.entity_path == "/samples" and not chunk.is_static
        ]
        return max(times) * 1e-9 if times else None

    def close(self) -> None:
        """End it."""
        self._started.end(10.0)
        self._program.close()


def start(node: str, parameters: dict[str, str]) -> subprocess.Popen[bytes]:
    """A node in a process of its own, quiet."""
    settings = [part for key, value in parameters.items() for part in ("-p", f"{key}:={value}")]
    command = [sys.executable, "-m", f"ab_sim.nodes.{node}", "--ros-args", *settings]
    return subprocess.Popen([*command, "--log-level", "warn"])


def end(process: subprocess.Popen[bytes]) -> int:
    """Ctrl-C; the exit code."""
    process.send_signal(signal.SIGINT)
    return process.wait(60.0)


def cpu(process: subprocess.Popen[bytes]) -> float:
    """Time that a process, without those that it has started, has taken of a core [s]."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident(process: subprocess.Popen[bytes]) -> float:
    """Memory of a process [MB]."""
    pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def measure(watch: Watch, folder: Path, seconds: float) -> dict[str, Any]:
    """The recorder beside a drive that runs, with a viewer."""
    print(f"recording for {seconds:g} s ...", file=sys.stderr)
    recorder = start("recorder", {"path": str(folder / "run.rrd"), "view": "web"})
    mine = lambda: watch.values.get("recorder", {})  # noqa: E731
    watch.until(lambda: mine().get("viewer state") == "showing" and mine()["file"], "a viewer")
    url = "rerun+http" + mine()["viewer"].rpartition("rerun%2Bhttp")[2]
    url = url.replace("%3A", ":").replace("%2F", "/")
    client = Client(url, folder / "client.rrd")
    watch.command(2.0)
    began, spent, memory, delays = time.monotonic(), cpu(recorder), [], []
    for _ in range(LOOKS):
        watch.command(seconds / LOOKS)
        newest, now = client.newest(), watch.clock[-1][1]
        memory.append((round(time.monotonic() - began, 1), resident(recorder)))
        if newest is not None:
            delays.append(now - newest)
    share = (cpu(recorder) - spent) / (time.monotonic() - began)
    code = end(recorder)
    client.close()
    times, sizes = np.array(memory[LOOKS // 5 :]).T
    keys = ("samples written", "samples missing", "samples lost", "messages dropped")
    return {
        **{key: int(mine()[key]) for key in keys},
        "recorder's share of a core": round(share, 3),
        "memory of the recorder [s, MB]": memory,
        "growth of memory [MB/h]": round(3600.0 * float(np.polyfit(times, sizes, 1)[0]), 1),
        "age of the newest sample in a client [s]": {
            "median": round(float(np.median(delays)), 3),
            "largest": round(max(delays), 3),
            "looks": len(delays),
        },
        "bytes of the file per s": round((folder / "run.rrd").stat().st_size / seconds),
        "exit code": code,
    }


def compare(watch: Watch, folder: Path, rounds: int) -> dict[str, list[dict[str, float]]]:
    """The drive's lateness by turns without and with the recorder."""
    found: dict[str, list[dict[str, float]]] = {"without": [], "with": []}
    for number in range(rounds):
        for kind in found:
            print(f"{kind} recorder, {number + 1} of {rounds} ...", file=sys.stderr)
            recorder = None
            if kind == "with":
                watch.values.pop("recorder", None)
                recorder = start("recorder", {"path": str(folder / f"{number}.rrd")})
                watch.until(lambda: watch.values.get("recorder", {}).get("file"), "a recorder")
            watch.command(1.0)
            watch.clock.clear()
            before = dict(watch.values["drive_sim"])
            watch.command(ROUND)
            wall, simulated = np.array(watch.clock).T
            late = wall - simulated
            late -= late.min()
            after = watch.values["drive_sim"]
            found[kind].append(
                {
                    **{
                        f"p{p:g} [ms]": round(1e3 * np.percentile(late, p), 2)
                        for p in (50, 99, 99.9)
                    },
                    **{k: int(after[k]) - int(before[k]) for k in ("overruns", "steps dropped")},
                }
            )
            if recorder is not None:
                end(recorder)
    return found


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=600.0, help="how long to record")
    parser.add_argument("--rounds", type=int, default=3, help="without and with the recorder")
    parser.add_argument("--out", type=Path, help="write the JSON there, too")
    given = parser.parse_args()
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    watch, drive = Watch(), start("drive_sim", DRIVE)
    try:
        watch.until(lambda: "drive_sim" in watch.values, "a drive")
        with tempfile.TemporaryDirectory() as folder:
            result: dict[str, Any] = {"seconds": given.seconds, "cores": os.cpu_count()}
            result |= measure(watch, Path(folder), given.seconds)
            result["lateness of the drive"] = compare(watch, Path(folder), given.rounds)
        result["load average"] = os.getloadavg()
        result["steps dropped by the drive"] = int(watch.values["drive_sim"]["steps dropped"])
    finally:
        end(drive)
    text = json.dumps(result, indent=1)
    print(text)
    if given.out:
        given.out.write_text(text + "\n")
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()

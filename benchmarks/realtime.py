"""How real a drive's time is: lateness, CPU, delay and memory, beside what the system alone gives.

    python benchmarks/realtime.py [--seconds 600] [--memory 0] [--out docs]

writes realtime.json and realtime.png. The five-ball scene, a sample and a wake-up each millisecond,
with profile controller, recorder and one subscriber, this process, each a process of its own. All
the time beside them a bare loop waits for the same grid of deadlines and does nothing else. Then
the same with every core loaded by a busy process; then every sample in a block of its own. With
``--memory`` so many seconds more at 10 times real time, with an eye on memory.
Recordings, then some 15 GB an hour, go to a temporary folder (TMPDIR) and are deleted.

Lateness and delays are of messages as they are received, so that the way is in them; what the drive
says of itself is given beside that.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from arguments import folder  # noqa: E402
from heard import QUANTILES, Ear, Pace, delays, missing, recovered, spread  # noqa: E402
from recorder import cpu, end, resident, start  # noqa: E402

from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.studies.effect_cost import conditions  # noqa: E402

SCENE, STEP, RATE = "five-balls-8000-rpm", 1e-3, 1000.0
NODES = ("drive_sim", "profile_controller", "recorder")
TOP = 800.0
"""rad/s, to which the speed grows all the time, so that no two commands are the same."""
SETTLE, RECOVERY, LOOKS = 3.0, 6.0, 60
SAID = (
    "real-time factor, 60 s", "overruns", "steps dropped", "lateness, p50 [s]", "lateness, p99 [s]",
    "lateness, p99.9 [s]", "worst lateness [s]", "command to output, p50 [s]",
    "command to output, p99 [s]", "inputs, mean [s]", "integration, mean [s]",
    "observing, mean [s]", "publishing, mean [s]", "error checks' share of work",
)  # fmt: skip
BARE = """
import math, signal, sys, threading, time
import numpy as np
period, ended, rows = float(sys.argv[1]), threading.Event(), []
signal.signal(signal.SIGTERM, lambda *_: ended.set())
begin, wakes = time.monotonic(), 1
while not ended.wait(max(begin + wakes * period - time.monotonic(), 0.0)):
    now = time.monotonic()
    late = max(now - begin - wakes * period, 0.0)
    rows.append((now, late))
    wakes += math.floor(late / period) + 1
np.save(sys.argv[2], np.array(rows))
"""


class Bench:
    """A drive with all that runs beside it."""

    def __init__(self, ear: Ear, place: Path, seconds: float, **drive: float) -> None:
        slope = TOP / seconds / drive.get("speed_factor", 1.0)
        changes = json.dumps([f"solver.step={STEP}", f"profile.acceleration={slope:.6g}"])
        same = {"changes": changes}
        numbers = {"wake_rate": RATE, **drive}
        settings = {
            "recorder": {"path": str(place / "run.rrd")},
            "drive_sim": {"scene": SCENE, **same, **{k: str(v) for k, v in numbers.items()}},
            "profile_controller": {
                "profile": SCENE, "use_sim_time": "true", "auto_start": "true", **same,
            },
        }  # fmt: skip
        self.ear, self._place, self._settings = ear, place, settings
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> "Bench":
        ear = self.ear
        with ExitStack() as failing:
            failing.push(self.__exit__)
            for node, parameters in self._settings.items():
                ear.values.pop(node, None)
                self.processes[node] = start(node, parameters)
                ear.until(lambda node=node: node in ear.values, node)
            bare = [sys.executable, "-c", BARE, str(1.0 / RATE), str(self._place / "bare.npy")]
            self.processes["bare loop"] = subprocess.Popen(bare)
            ear.until(lambda: ear.values["recorder"].get("file"), "a recording")
            ear.listen(SETTLE)
            failing.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        for process in self.processes.values():
            process.kill()
            process.wait()

    def run(self, seconds: float) -> dict[str, Any]:
        """Listen, and say how it went."""
        ear, spent, begin = self.ear, self._spent(), time.monotonic()
        before = self._counted()
        ear.forget()
        ear.listen(seconds)
        passed = time.monotonic() - begin
        shares = {name: (now - spent[name]) / passed for name, now in self._spent().items()}
        dead = [name for name, process in self.processes.items() if process.poll() is not None]
        if dead:
            raise SystemExit(f"ended by themselves: {dead}")
        pace = Pace.of(ear.clock, STEP)
        return {
            "seconds": round(passed, 1),
            "from, to [s]": [begin, begin + passed],
            "simulated time lost [s]": round(pace.lost, 6),
            "real-time factor": round(pace.factor, 7),
            "wrong stamps": pace.wrong,
            "samples missing": missing(ear),
            "lateness": spread(pace.lateness),
            "wake-ups a period or more late": int(np.sum(pace.lateness >= 1.0 / RATE)),
            "command to output": spread(delays(ear, STEP)),
            "share of a core": {name: round(share, 3) for name, share in shares.items()},
            "the drive's own words": {
                "meanwhile": {key: now - before[key] for key, now in self._counted().items()},
                "since it began": self._said(),
            },
        }

    def recover(self, ended: float, usual: float) -> float | None:
        """How long it took after a load had ended [s]; ``usual``: share of overruns before."""
        self.ear.forget()
        self.ear.listen(RECOVERY)
        return recovered(Pace.of(self.ear.clock, STEP), ended, 1.0 / RATE, usual)

    def memory(self, seconds: float) -> dict[str, Any]:
        """Of each node over time, but for the first tenth."""
        begin, looks = time.monotonic(), []
        for _ in range(LOOKS):
            self.ear.forget()
            self.ear.listen(seconds / LOOKS)
            sizes = [resident(self.processes[node]) for node in NODES]
            looks.append([round(time.monotonic() - begin, 2), *sizes])
        times, *sizes = np.array(looks[LOOKS // 10 :]).T
        growth = [3600.0 * float(np.polyfit(times, size, 1)[0]) for size in sizes]
        return {
            "[s], [MB] of each": looks,
            "growth [MB/h]": dict(zip(NODES, np.round(growth, 2).tolist(), strict=True)),
            "the drive's own words": self._said(),
            "samples missing in the recording": self.ear.values["recorder"]["samples missing"],
        }

    def close(self) -> dict[str, Any]:
        """End all; exit codes, what the recorder says, and the bare loop's rows."""
        self.processes["bare loop"].terminate()
        self.processes.pop("bare loop").wait(60.0)
        codes = {node: end(self.processes[node]) for node in reversed(NODES)}
        self.ear.listen(1.0)
        said = self.ear.values["recorder"]
        keys = ("samples written", "samples missing", "samples lost", "messages dropped")
        return {"exit codes": codes, "recorder": {key: said[key] for key in keys}}

    def bare(self, part: dict[str, Any]) -> dict[str, Any]:
        """How late the bare loop was meanwhile."""
        at, late = np.load(self._place / "bare.npy").T
        begin, until = part.pop("from, to [s]")
        return spread(late[(at >= begin) & (at < until)])

    def _spent(self) -> dict[str, float]:
        return {**{n: cpu(p) for n, p in self.processes.items()}, "subscriber": time.process_time()}

    def _counted(self) -> dict[str, int]:
        said = self.ear.values["drive_sim"]
        return {key: int(said[key]) for key in ("overruns", "steps dropped")}

    def _said(self) -> dict[str, str]:
        said = self.ear.values["drive_sim"]
        return {key: said[key] for key in SAID if key in said}


@contextmanager
def load() -> Iterator[None]:
    """A busy process for each core."""
    busy = [sys.executable, "-c", "while True: pass"]
    with ExitStack() as running:
        for _ in range(os.cpu_count() or 1):
            process = subprocess.Popen(busy)
            running.callback(process.wait)
            running.callback(process.kill)
        yield


def measure(seconds: float, memory: float) -> dict[str, Any]:
    """All there is to measure."""
    report: dict[str, Any] = {}
    ear, short = Ear(), max(seconds / 5.0, 10.0)
    all_told = seconds + short + SETTLE + RECOVERY
    with tempfile.TemporaryDirectory() as place, Bench(ear, Path(place), all_told) as bench:
        quiet = report["quiet"] = bench.run(seconds)
        with load():
            report["loaded"] = bench.run(short)
        ended = time.monotonic()
        usual = quiet["wake-ups a period or more late"] / quiet["lateness"]["count"]
        report["loaded"]["recovered after [s]"] = bench.recover(ended, usual)
        report["ended"] = bench.close()
        for part in ("quiet", "loaded"):
            report[part]["bare loop"] = bench.bare(report[part])
    with (
        tempfile.TemporaryDirectory() as place,
        Bench(ear, Path(place), short + SETTLE, block_rate=RATE) as bench,
    ):
        report["every sample in a block of its own"] = part = bench.run(short)
        part["ended"] = bench.close()
        part["bare loop"] = bench.bare(part)
    if memory:
        with (
            tempfile.TemporaryDirectory() as place,
            Bench(ear, Path(place), memory + SETTLE, speed_factor=10.0) as bench,
        ):
            report["memory"] = bench.memory(memory)
            report["memory"]["ended"] = bench.close()
    return report


def picture(report: dict[str, Any], path: Path) -> None:
    """Lateness of drive and bare loop, quiet and loaded; memory over time."""
    from matplotlib.figure import Figure

    panels = 2 if "memory" in report else 1
    made = Figure(figsize=(6.2 * panels + 1.0, 4.6), layout="constrained")
    left, *right = made.subplots(1, panels, squeeze=False)[0]
    for part, line in (("quiet", "-"), ("loaded", "--")):
        for what, found, colour in (
            ("drive, as heard by a subscriber", report[part]["lateness"], "tab:red"),
            ("bare loop", report[part]["bare loop"], "tab:blue"),
        ):
            # No share is shown of which there is less than one wake-up.
            seen = 1.0 - QUANTILES >= 1.0 / found["count"]
            late = np.maximum(np.array(found["at QUANTILES [ms]"])[seen], 1e-3)
            left.plot(late, (1.0 - QUANTILES)[seen], line, color=colour, label=f"{what}, {part}")
    left.axvline(1e3 / RATE, color="0.5", linestyle=":", label="one period")
    left.set(xscale="log", yscale="log", xlabel="lateness [ms]")
    left.set_ylabel("share of wake-ups that are later")
    left.set_title(f"wake-ups at {RATE:g} Hz, five balls", fontsize=11)
    left.grid(alpha=0.3)
    left.legend(fontsize=8)
    for axes in right:
        times, *sizes = np.array(report["memory"]["[s], [MB] of each"]).T
        for node, size in zip(NODES, sizes, strict=True):
            growth = report["memory"]["growth [MB/h]"][node]
            axes.plot(times / 60.0, size, label=f"{node}, {growth:+.1f} MB/h")
        axes.set(xlabel="time [min]", ylabel="memory [MB]", ylim=(0.0, None))
        axes.set_title("memory at 10 times real time", fontsize=11)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    made.savefig(path, dpi=120)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=_seconds, default=600.0, help="of the quiet run")
    parser.add_argument("--memory", type=_seconds, default=0.0, help="seconds at 10 times speed")
    docs = Path(__file__).resolve().parents[1] / "docs"
    parser.add_argument("--out", type=folder, default=docs, help="folder for what is written")
    given = parser.parse_args()
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    before = conditions()
    report = {
        **before, "clock": "steady, and CPU time of processes", "scene": SCENE, "step [s]": STEP,
        "wake-ups [1/s]": RATE, **measure(given.seconds, given.memory),
    }  # fmt: skip
    write_json(report, str(given.out / "realtime.json"))
    picture(report, given.out / "realtime.png")
    rclpy.try_shutdown()


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 10.0 <= seconds <= 1e6:
        raise argparse.ArgumentTypeError(f"{text}: must be from 10 to 1e6 s")
    return seconds


if __name__ == "__main__":
    main()

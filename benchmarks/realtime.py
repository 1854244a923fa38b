"""Real-time behaviour of a drive: lateness, CPU, delay and memory, compared with the system alone.

    python benchmarks/realtime.py [--parts quiet loaded blocks scheduled] [--seconds 600]
                                  [--memory 3600] [--out docs]

writes realtime.json and realtime.png. The five-ball scene, with a sample and a wake-up each
millisecond, runs with profile controller, recorder and one subscriber, this process, each in a
separate process. In parallel, a bare loop waits for the same grid of deadlines and does nothing
else. Parts:

- quiet: nothing else runs;
- loaded: a busy process for each core;
- blocks: every sample in a separate block;
- scheduled: drive and bare loop with SCHED_FIFO, locked memory and explicit garbage collection;
- memory: an hour, or ``--memory`` seconds, at 10 times real time. Its recording, some 15 GB, goes
  to a temporary folder (TMPDIR) and is deleted.

Each part except quiet and memory takes a fifth of ``--seconds``. Other parts stay in realtime.json,
each with its conditions; ``--parts`` alone only draws.

Lateness and delays are those of received messages, transport included. The values that the drive
reports are given in addition.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from arguments import folder  # noqa: E402
from heard import QUANTILES, Ear  # noqa: E402
from live_drive import (  # noqa: E402
    NODES,
    RATE,
    RECOVERY,
    SCENE,
    SCHEDULED,
    SETTLE,
    STEP,
    Bench,
)

from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402

USUAL = 10.0
"""Time before a load to which recovery is compared [s]."""


@contextmanager
def load() -> Iterator[None]:
    """Run a busy process for each core."""
    busy = [sys.executable, "-c", "while True: pass"]
    with ExitStack() as running:
        for _ in range(os.cpu_count() or 1):
            process = subprocess.Popen(busy)
            running.callback(process.wait)
            running.callback(process.kill)
        yield


def quiet(ear: Ear, seconds: float, **drive: str) -> dict[str, Any]:
    """Measure while only these nodes run."""
    with Bench(ear, seconds + SETTLE, **drive) as bench:
        part = bench.run(seconds)
        part["ended"] = bench.close()
        part["bare loop"] = bench.bare(part)
    return part


def loaded(ear: Ear, seconds: float) -> dict[str, Any]:
    """Measure under full load and afterwards."""
    with Bench(ear, USUAL + seconds + SETTLE + RECOVERY) as bench:
        before = bench.run(USUAL)
        usual = before["wake-ups a period or more late"] / before["lateness"]["count"]
        with load():
            part = bench.run(seconds)
        part["recovered after [s]"] = bench.recover(time.monotonic(), usual)
        part["ended"] = bench.close()
        part["bare loop"] = bench.bare(part)
    return part


def memory(ear: Ear, seconds: float) -> dict[str, Any]:
    """Measure the memory of each node at 10 times real time."""
    with Bench(ear, seconds + SETTLE, speed_factor="10.0") as bench:
        part = bench.memory(seconds)
        part["ended"] = bench.close()
    return part


def measures(seconds: float, long: float) -> dict[str, tuple[str, Callable[[Ear], dict[str, Any]]]]:
    """Return the measurement of each part with its title in the report."""
    short = max(seconds / 5.0, 10.0)
    return {
        "quiet": ("quiet", lambda ear: quiet(ear, seconds)),
        "loaded": ("loaded", lambda ear: loaded(ear, short)),
        "blocks": (
            "every sample in a block of its own",
            lambda ear: quiet(ear, short, block_rate=str(RATE)),
        ),
        "scheduled": (
            "with real-time scheduling",
            lambda ear: quiet(ear, short, **SCHEDULED),
        ),
        "memory": ("memory", lambda ear: memory(ear, long)),
    }


def picture(report: dict[str, Any], path: Path) -> None:
    """Draw lateness of drive and bare loop for each part, and memory over time."""
    from matplotlib.figure import Figure

    panels = 2 if "memory" in report else 1
    made = Figure(figsize=(6.2 * panels + 1.0, 4.8), layout="constrained")
    left, *right = made.subplots(1, panels, squeeze=False)[0]
    for part, colour in (
        ("quiet", "tab:blue"),
        ("loaded", "tab:red"),
        ("with real-time scheduling", "tab:green"),
    ):
        for what, line in (("lateness", "-"), ("bare loop", "--")) if part in report else ():
            found = report[part][what]
            # No share is shown of which there is less than one wake-up.
            seen = 1.0 - QUANTILES >= 1.0 / found["count"]
            late = np.maximum(np.array(found["at QUANTILES [ms]"])[seen], 1e-3)
            told = f"{part}: {'drive' if what == 'lateness' else what}"
            left.plot(late, (1.0 - QUANTILES)[seen], line, color=colour, label=told)
    left.axvline(1e3 / RATE, color="0.5", linestyle=":", label="one period")
    left.set(xscale="log", yscale="log", xlabel="lateness [ms]; of drives as a subscriber hears it")
    left.set_xlim(left=0.03)
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
    """Run the command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    every = list(measures(0.0, 0.0))
    parser.add_argument("--parts", nargs="*", choices=every, default=every[:-1], metavar="PART")
    parser.add_argument("--seconds", type=_seconds, default=600.0, help="of the quiet run")
    parser.add_argument("--memory", type=_seconds, default=3600.0, help="seconds of that part")
    docs = Path(__file__).resolve().parents[1] / "docs"
    parser.add_argument("--out", type=folder, default=docs, help="folder for what is written")
    given = parser.parse_args()
    file = given.out / "realtime.json"
    report = json.loads(file.read_text()) if file.exists() else {}
    report |= {"scene": SCENE, "step [s]": STEP, "wake-ups [1/s]": RATE}
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    ear = Ear()
    for part in given.parts:
        name, measure = measures(given.seconds, given.memory)[part]
        before = conditions() | {"clock": "steady, and CPU time of processes"}
        report[name] = {**measure(ear), "conditions": before}
        write_json(report, str(file))  # an hour later something may go wrong
    if "quiet" in report:
        picture(report, given.out / "realtime.png")
    rclpy.try_shutdown()


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 10.0 <= seconds <= 1e6:
        raise argparse.ArgumentTypeError(f"{text}: must be from 10 to 1e6 s")
    return seconds


if __name__ == "__main__":
    main()

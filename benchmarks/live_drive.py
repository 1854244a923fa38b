"""Drive with its companion processes; for realtime.py."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from heard import Ear, Pace, delays, missing, recovered, spread

SCENE, STEP, RATE = "five-balls-8000-rpm", 1e-3, 1000.0
NODES = ("drive_sim", "profile_controller", "recorder")
TOP = 800.0
"""Speed to which the drive accelerates all the time, so that all commands differ [rad/s]."""
SETTLE, RECOVERY, LOOKS = 3.0, 6.0, 60
PRIORITY = "realtime_priority"
SCHEDULED = {PRIORITY: "50", "lock_memory": "true", "garbage_by_hand": "true"}
"""All real-time settings that a drive can request of the system."""
SAID = (
    "real-time factor, 60 s", "overruns", "steps dropped", "lateness, p50 [s]", "lateness, p99 [s]",
    "lateness, p99.9 [s]", "worst lateness [s]", "command to output, p50 [s]",
    "command to output, p99 [s]", "inputs, mean [s]", "integration, mean [s]",
    "observing, mean [s]", "publishing, mean [s]", "error checks' share of work",
)  # fmt: skip
BARE = """
import math, signal, sys, threading, time
import numpy as np
from ab_sim.nodes.realtime import RealTimeRequests
period, ended, rows = float(sys.argv[1]), threading.Event(), []
priority = int(sys.argv[3])
if refused := RealTimeRequests(priority, priority > 0, priority > 0).apply():
    sys.exit("; ".join(refused))
signal.signal(signal.SIGTERM, lambda *_: ended.set())
begin, wakes = time.monotonic(), 1
while not ended.wait(max(begin + wakes * period - time.monotonic(), 0.0)):
    now = time.monotonic()
    late = max(now - begin - wakes * period, 0.0)
    rows.append((now, late))
    wakes += math.floor(late / period) + 1
np.save(sys.argv[2], np.array(rows))
"""


def start(node: str, parameters: dict[str, str]) -> subprocess.Popen[bytes]:
    """Start a node as a quiet process."""
    settings = [part for key, value in parameters.items() for part in ("-p", f"{key}:={value}")]
    command = [sys.executable, "-m", f"ab_sim.nodes.{node}", "--ros-args", *settings]
    return subprocess.Popen([*command, "--log-level", "warn"])


def end(process: subprocess.Popen[bytes]) -> int:
    """Press Ctrl-C, and return the exit code."""
    process.send_signal(signal.SIGINT)
    return process.wait(60.0)


def cpu(process: subprocess.Popen[bytes]) -> float:
    """Return the CPU time of a process without its children [s]."""
    fields = (
        Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    )
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident(process: subprocess.Popen[bytes]) -> float:
    """Return the memory of a process [MB]."""
    pages = int(Path(f"/proc/{process.pid}/statm").read_text(encoding="utf-8").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class Bench:
    """Drive with its companion processes.

    Parameters
    ----------
    ear
        subscriber.
    seconds
        Longest duration of the run [s].
    drive
        Parameters of the drive.
    """

    def __init__(self, ear: Ear, seconds: float, **drive: str) -> None:
        slope = TOP / seconds / float(drive.get("speed_factor", 1.0))
        changes = json.dumps([f"solver.step={STEP}", f"profile.acceleration={slope:.6g}"])
        same = {"changes": changes}
        self._temporary = tempfile.TemporaryDirectory()
        self._place = Path(self._temporary.name)
        self._priority = drive.get(PRIORITY, "0")
        settings = {
            "recorder": {"path": str(self._place / "run.rrd")},
            "drive_sim": {"scene": SCENE, "wake_rate": str(RATE), **same, **drive},
            "profile_controller": {
                "profile": SCENE, "use_sim_time": "true", "auto_start": "true", **same,
            },
        }  # fmt: skip
        self.ear, self._settings = ear, settings
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> "Bench":
        ear = self.ear
        with ExitStack() as failing:
            failing.push(self.__exit__)
            for node, parameters in self._settings.items():
                ear.values.pop(node, None)
                self.processes[node] = start(node, parameters)
                ear.until(lambda node=node: node in ear.values, node)
            file = str(self._place / "bare.npy")
            bare = [sys.executable, "-c", BARE, str(1.0 / RATE), file, self._priority]
            self.processes["bare loop"] = subprocess.Popen(bare)
            ear.until(lambda: ear.values["recorder"].get("file"), "a recording")
            ear.listen(SETTLE)
            failing.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        for process in self.processes.values():
            process.kill()
            process.wait()
        self._temporary.cleanup()

    def run(self, seconds: float) -> dict[str, Any]:
        """Receive messages for a time [s] and return the results."""
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
        """Return the time of recovery after a load [s]; ``usual``: share of overruns before it."""
        self.ear.forget()
        self.ear.listen(RECOVERY)
        return recovered(Pace.of(self.ear.clock, STEP), ended, 1.0 / RATE, usual)

    def memory(self, seconds: float) -> dict[str, Any]:
        """Return the memory of each node over time, without the first tenth."""
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
        """Stop all processes; return exit codes, the recorder's values and the bare loop's rows."""
        self.processes["bare loop"].terminate()
        self.processes.pop("bare loop").wait(60.0)
        codes = {node: end(self.processes[node]) for node in reversed(NODES)}
        self.ear.listen(1.0)
        said = self.ear.values["recorder"]
        keys = ("samples written", "samples missing", "samples lost", "messages dropped")
        return {"exit codes": codes, "recorder": {key: said[key] for key in keys}}

    def bare(self, part: dict[str, Any]) -> dict[str, Any]:
        """Return the lateness of the bare loop during a part."""
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

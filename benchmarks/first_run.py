"""Time of the first run of a scene on a new machine, and its parts.

    python benchmarks/first_run.py [--repeats 3] [--out FOLDER]

Each run is a separate process with an empty cache folder. It imports the package, creates a drive
and runs the scene to its end. Two commands are timed in the same way: `ab-sim run`, which runs the
scene also without balls, and README's first command, which draws, too. In a process that has run a
scene, further sets of effects, numbers of balls, kinds of segment and steppers are timed in turn,
from a scene to its first step. Prints a table and writes first-run.json: medians of wall time, of
the CPU time of the whole process, and of its peak memory.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402

STIFF = "effects.viscous_drag.coefficient=100"
RUNS: dict[str, tuple[str, ...]] = {
    "thesis-hold": ("thesis-hold",),
    "thesis-hold, drag x 100": ("thesis-hold", STIFF),
    "on-edge": ("on-edge",),
    "feeding-deck": ("feeding-deck",),
}
"""Scenes with their changes."""
SPEED_CHANGE = (
    "profile=",
    "profile.kind=speed_change",
    "profile.start_time=0.0",
    "profile.duration=0.5",
    "profile.to_speed=100.0",
)
FURTHER: dict[str, tuple[str, ...]] = {
    "set of effects": ("thesis-hold", "effects.gravity.tilt=0.3"),
    "set of effects with contact": ("on-edge",),
    "number of balls": ("thesis-hold", "balls.count=3", "start.ball_angles=[0.0,1.0,3.0]"),
    "kind of segment": ("thesis-hold", *SPEED_CHANGE),
    "stepper": ("thesis-hold", "solver.stepper=tsit5"),
    "stepper of stiff drag": ("thesis-hold", STIFF),
    "the other plant": ("feeding-deck",),
}
"""Scenes with changes for a process that has run thesis-hold."""
COMMANDS = (("run", "thesis-hold"), ("run", "thesis-hold", "--plot"))
"""Arguments of ab-sim: a run alone, and README's first command; a picture's name follows."""
MACHINE_CODE, IMPORTS, FIRST_STEP, TO_THE_END = "machine code", "imports", "first step", "the end"
WHOLE, CPU, MEMORY = "whole", "whole, CPU time", "most memory [MB]"


def watched() -> Counter[str]:
    """Count the time in LLVM from now on."""
    from ab_sim.tracing.machine_code import MachineCode

    spent: Counter[str] = Counter()
    make = MachineCode.__init__

    def timed(self: Any, *given: Any, **named: Any) -> None:
        began = time.perf_counter()
        make(self, *given, **named)
        spent[MACHINE_CODE] += time.perf_counter() - began

    MachineCode.__init__ = timed  # type: ignore[method-assign]
    return spent


def child(name: str, *changes: str) -> None:
    """Run a scene and print the times of its parts as JSON."""
    began = time.perf_counter()
    from ab_sim.drive import Drive
    from ab_sim.scene import load_scene

    spent, imported = watched(), time.perf_counter()
    scene = load_scene(name, changes)
    drive = Drive(scene)
    drive.advance(1)
    stepped = time.perf_counter()
    drive.advance(round(scene.duration / scene.solver.step) - 1)
    ended = time.perf_counter()
    spent |= {
        IMPORTS: imported - began,
        FIRST_STEP: stepped - imported,
        TO_THE_END: ended - stepped,
        MEMORY: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
    }
    print(json.dumps(spent))


def further() -> None:
    """Start each further scene and print the time to its first step as JSON."""
    from ab_sim.drive import Drive
    from ab_sim.scene import load_scene

    def first_step(name: str, *changes: str) -> float:
        began = time.perf_counter()
        Drive(load_scene(name, changes)).advance(1)
        return time.perf_counter() - began

    first_step("thesis-hold")
    print(json.dumps({what: first_step(*asked) for what, asked in FURTHER.items()}))


def run(cache: str, *asked: str) -> dict[str, float]:
    """Run a Python process with a cache folder; return its output and the total time [s]."""
    # Installed packages have their byte-code; here it is written in the first repeat.
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    began, used = time.perf_counter(), _cpu_of_children()
    done = subprocess.run(
        [sys.executable, *asked],
        env=environment | {"XDG_CACHE_HOME": cache},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    whole = {WHOLE: time.perf_counter() - began, CPU: _cpu_of_children() - used}
    found: dict[str, float] = json.loads(done.stdout) if asked[0] == __file__ else {}
    return {**found, **whole}


def _cpu_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run_scene(cache: str, *asked: str) -> dict[str, float]:
    """Run a scene in a separate process."""
    return run(cache, __file__, "--child", *asked)


def command(cache: str, words: tuple[str, ...]) -> dict[str, float]:
    """Run a command of ``COMMANDS``."""
    picture = [str(Path(cache, "hold.png"))] if words[-1] == "--plot" else []
    return run(cache, "-m", "ab_sim", *words, *picture)


def main() -> None:
    """Run all cases in turns."""
    asked = arguments(__doc__ or "", repeats=3).parse_args()
    measured: dict[str, Callable[[str], dict[str, float]]] = {
        what: lambda cache, changed=changed: run_scene(cache, *changed)
        for what, changed in RUNS.items()
    }
    measured |= {
        " ".join(("ab-sim", *words)): lambda cache, words=words: command(cache, words)
        for words in COMMANDS
    }
    measured["further"] = lambda cache: run(cache, __file__, "--further")
    runs: dict[str, list[dict[str, float]]] = {}
    for _ in range(asked.repeats):
        for what, measure in measured.items():
            with tempfile.TemporaryDirectory() as cache:
                runs.setdefault(what, []).append(measure(cache))
            print(what, f"{runs[what][-1][WHOLE]:.2f} s", file=sys.stderr)
    table = {
        what: {part: round(median(one[part] for one in all_), 3) for part in all_[0]}
        for what, all_ in runs.items()
    }
    told = {"load average": os.getloadavg(), "repeats": asked.repeats, "s": table}
    text = json.dumps(told, indent=1)
    (asked.out / "first-run.json").write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(*sys.argv[2:])
    elif sys.argv[1:2] == ["--further"]:
        further()
    else:
        main()

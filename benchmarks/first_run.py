"""What the first run of a scene takes on a new machine, and what that time is made of.

    python benchmarks/first_run.py [SCENE ...] [--repeats 3] [--out FOLDER]

Each run is a process of its own with an empty cache of kernels, which makes a drive and takes a
step; then the same again with what it has kept. README's first command is timed so, too: it runs
the scene also without balls, which is another kernel, and draws. Prints a table and writes
first-run.json: medians of wall time. Passes of the compiler are counted without those that they
call; the kernel of events, which serves all scenes with friction or contact, is compiled by another
process meanwhile.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402

SCENES = ("no-ball", "thesis-hold", "on-edge")
COMMAND = ("run", "thesis-hold", "--plot")
"""Of ab-sim; the picture's name follows."""
PARTS = {
    "nopython_type_inference": "types",
    "native_lowering": "writing for LLVM",
    "numba:llvm_lock": "LLVM",
}
"""Of passes and events; all others are "other passes"."""


def child(name: str, *changes: str) -> None:
    """Run a scene and print what the time went into, as JSON; imports go on until it is read."""
    began = time.perf_counter()
    from numba.core import event

    from ab_sim.drive import Drive
    from ab_sim.scene import load_scene

    spent: Counter[str] = Counter()
    stack: list[list[Any]] = []  # part, since when, how long others

    class Watch(event.Listener):
        def on_start(self, event: Any) -> None:
            name = event.data["name"].split()[0] if event.kind == "numba:run_pass" else event.kind
            stack.append([PARTS.get(name, "other passes"), time.perf_counter(), 0.0])

        def on_end(self, event: Any) -> None:
            part, start, within = stack.pop()
            length = time.perf_counter() - start
            spent[part] += length - within
            if stack:
                stack[-1][2] += length

    for kind in ("numba:run_pass", "numba:llvm_lock"):
        event.register(kind, Watch())
    scene = load_scene(name, changes)
    imported = time.perf_counter()
    Drive(scene).advance(1)
    ended = time.perf_counter()
    spent["imports"] = imported - began
    spent["the rest"] = ended - began - sum(spent.values())
    print(json.dumps({"whole": ended - began} | dict(spent)))


def run(cache: str, scene: str, *changes: str) -> dict[str, float]:
    """One process, which keeps its kernels in a folder: what it spent on what [s], and on all."""
    done = subprocess.run(
        [sys.executable, __file__, "--child", scene, *changes],
        env={**os.environ, "XDG_CACHE_HOME": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, float] = json.loads(done.stdout)
    return found


def command(cache: str) -> dict[str, float]:
    """README's first command, from its start to its end [s]."""
    began = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "ab_sim", *COMMAND, str(Path(cache, "hold.png"))],
        env={**os.environ, "XDG_CACHE_HOME": cache},
        capture_output=True,
        check=True,
    )
    return {"whole": time.perf_counter() - began}


def main() -> None:
    """Run all, by turns."""
    parser = arguments(__doc__ or "", repeats=3)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    asked = parser.parse_args()
    runs: dict[str, list[dict[str, float]]] = {}
    for _ in range(asked.repeats):
        measured = {scene: partial(run, scene=scene) for scene in asked.scenes}
        for name, measure in {**measured, " ".join(("ab-sim", *COMMAND)): command}.items():
            with tempfile.TemporaryDirectory() as cache:
                for what in (name, f"{name}, again"):
                    runs.setdefault(what, []).append(measure(cache))
                    print(what, f"{runs[what][-1]['whole']:.1f} s", file=sys.stderr)
    table = {
        what: {
            part: round(median(one.get(part, 0.0) for one in all_), 2)
            for part in sorted({part for one in all_ for part in one})
        }
        for what, all_ in runs.items()
    }
    told = {"load average": os.getloadavg(), "repeats": asked.repeats, "s": table}
    text = json.dumps(told, indent=1)
    (asked.out / "first-run.json").write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(*sys.argv[2:])
    else:
        main()

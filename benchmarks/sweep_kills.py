"""Kill a sweep fifty times, each at a random instant, and count what was lost or done twice.

    python benchmarks/sweep_kills.py [--kills 50] [--json docs/sweep-kills.json]

Each time the same command is given again; `kill -9` goes to all its processes at once. At the end
every run has to be there once, and as a sweep that was never killed gives it.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from pyarrow import parquet

RUNS = 20_000
COMMAND = [
    sys.executable, "-m", "ab_sim", "sweep", "no-ball", "--set", "duration=6",
    "--over", f"rotor.eccentricity=1e-5..1e-3:{RUNS}", "--workers", "2", "--parquet", "s.parquet",
]  # fmt: skip


def kept(folder: Path) -> list[int]:
    """Numbers of the runs that are on disk, as often as they are there."""
    files = folder.glob("cache/ab_sim/results/judged-*/*.parquet")
    return [run for file in files for run in parquet.read_table(file)["run"].to_pylist()]


def environment(folder: Path) -> dict[str, str]:
    """In which what is done is kept in a folder of its own."""
    return {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}


def killed(folder: Path, after: float) -> bool:
    """Whether the sweep was still at work then."""
    program = subprocess.Popen(
        COMMAND, cwd=folder, env=environment(folder), start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    time.sleep(after)
    at_work = program.poll() is None
    if at_work:
        os.killpg(program.pid, signal.SIGKILL)
    program.wait()
    return at_work


def main() -> None:
    """Kill, count, and compare with a sweep that was not killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    rng = random.Random(32)
    with tempfile.TemporaryDirectory() as name, tempfile.TemporaryDirectory() as other:
        folder, whole = Path(name), Path(other)
        done, doubled, lost, kills = 0, 0, 0, 0
        while kills < given.kills:
            if not killed(folder, rng.uniform(0.5, 6.0)):
                # It has come to its end: from the beginning.
                for file in folder.glob("cache/ab_sim/results/judged-*/*.parquet"):
                    file.unlink()
                done = 0
                continue
            kills += 1
            runs = kept(folder)
            doubled += len(runs) - len(set(runs))
            lost += max(0, done - len(set(runs)))
            done = len(set(runs))
            print(f"kill {kills}: {done} of {RUNS} runs are kept", flush=True)
        for place in (folder, whole):
            subprocess.run(COMMAND, cwd=place, env=environment(place), check=True)
        tables = [parquet.read_table(place / "s.parquet") for place in (folder, whole)]
        same = tables[0].equals(tables[1]) and len(tables[0]) == RUNS
    found = {"kills": kills, "runs": RUNS, "doubled": doubled, "lost": lost, "same": same}
    print(json.dumps(found))
    if given.json is not None:
        given.json.write_text(json.dumps(found, indent=1) + "\n")
    if doubled or lost or not same:
        sys.exit(1)


if __name__ == "__main__":
    main()

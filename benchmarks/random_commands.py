"""Random commands to every scene that ships: steps with unresolved events, and overlaps of balls.

    python benchmarks/random_commands.py [--commands 10000] [--out benchmarks/random_commands.json]

The commands are distributed over the scenes. Each command holds for 10 to 400 ms, forwards or
backwards, within the scene's ``spindle.max_speed``; every fourth follows within a few steps. The
report has for each scene the events, the steps with unresolved events, and the smallest gap between
balls that cannot pass each other, relative to their distance in contact.
"""

import argparse
import json
import platform
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from ab_sim.drive import Drive  # noqa: E402
from ab_sim.scene import load_scene, scene_names  # noqa: E402
from tests.overlap import least_gap  # noqa: E402


def tried(name: str, commands: int, rng: np.random.Generator) -> dict[str, float]:
    """Run one scene under a number of commands."""
    scene = load_scene(name)
    drive, least = Drive(scene, commanded=True), np.inf
    for count in range(commands):
        drive.command(rng.uniform(-1.0, 1.0) * scene.spindle.max_speed)
        held = rng.uniform(0.001, 0.01) if count % 4 == 3 else rng.uniform(0.01, 0.4)
        least = min(least, least_gap(drive, drive.advance(max(1, round(held / drive.step)))))
    return {
        "commands": commands,
        "simulated_seconds": drive.time,
        "events": drive.events,
        "steps_with_unresolved_events": drive.steps_with_unresolved_events,
        **({"least_gap": least} if np.isfinite(least) else {}),
    }


def main() -> None:
    """Run all scenes and write the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commands", type=int, default=10_000)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".json"))
    asked = parser.parse_args()
    names, begin, rows = scene_names(), time.process_time(), {}
    for name in names:
        rows[name] = tried(name, -(-asked.commands // len(names)), np.random.default_rng(1))
        print(f"{name:24s} {rows[name]}", flush=True)
    report = {
        "scenes": rows,
        "cpu_seconds": time.process_time() - begin,
        "machine": platform.platform(),
        "python": platform.python_version(),
    }
    asked.out.write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()

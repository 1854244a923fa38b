r"""This core beside a former one: time of runs, in turns.

    git worktree add --detach /tmp/former/tree 8c8862e
    python -m venv /tmp/former/venv
    /tmp/former/venv/bin/pip install -c /tmp/former/tree/constraints.txt \
        numba numpy scipy pydantic PyYAML typer rich pyarrow matplotlib plotly
    python benchmarks/former_core.py /tmp/former/tree /tmp/former/venv/bin/python [--only TEXT]

The last core with numba is 8c8862e. Each process has one core and one row, whose number is the
fastest of several repeats, the first one left out, in CPU time: a whole run of a new ``Drive``, its
first step apart, per step [ns]; a call of one step [ns]; a call of ``simulate_batch`` [ms]. Prints
medians over all processes, and old over new in each turn.

New drives by collocation find the tables of responses that one before has made, as far as it had
the same left-hand sides, which in the former core none did. So one row has other masses for each
drive, of balls and of what carries them: those tables are made anew, as for a process's first one.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import NamedTuple

REPEATS, CALLS, RUNS = 6, 20_000, 64
"""Runs of a process; calls of one step; runs of a batch."""
SMOOTH, COLLOCATION = "effects.rolling_friction=", "solver.stepper=collocation"

LESS_DRAG = "effects.viscous_drag.coefficient=0.03125"


def balls(count: int) -> tuple[str, ...]:
    """So many, spread over the race, without friction."""
    angles = [round(6.0 * k / count, 3) for k in range(count)]
    return (
        SMOOTH,
        f"balls.count={count}",
        f"balls.mass={2e-3 / count}",
        f"start.ball_angles={angles}",
    )


class Row(NamedTuple):
    """What is measured."""

    scene: str
    changes: tuple[str, ...] = ()
    kind: str = "run"


ROWS = {
    "thesis-hold, rk8": Row("thesis-hold", ("solver.stepper=rk8",)),
    "without friction": Row("thesis-hold", (SMOOTH, "solver.stepper=rk8")),
    "5 balls, rk8": Row("thesis-hold", (*balls(5), "solver.stepper=rk8")),
    "16 balls, rk8": Row("thesis-hold", (*balls(16), "solver.stepper=rk8")),
    # As much drag in all as of two balls: more is too stiff for rk8 at this step.
    "64 balls, rk8": Row("thesis-hold", (*balls(64), LESS_DRAG, "solver.stepper=rk8")),
    "on-edge, rk8": Row("on-edge", ("solver.stepper=rk8",)),
    "packed-balls": Row("packed-balls"),
    "feeding-deck, rk8": Row("feeding-deck", ("solver.stepper=rk8",)),
    "on-edge, collocation": Row("on-edge", (COLLOCATION,)),
    "5 balls, collocation": Row("thesis-hold", (*balls(5), COLLOCATION)),
    "16 balls, collocation": Row("thesis-hold", (*balls(16), COLLOCATION)),
    "64 balls, collocation": Row("thesis-hold", (*balls(64), COLLOCATION)),
    "feeding-deck, collocation": Row("feeding-deck", (COLLOCATION,)),
    "thesis-hold without friction, collocation": Row("thesis-hold", (SMOOTH, COLLOCATION)),
    "the same, each drive of other masses": Row("thesis-hold", (SMOOTH, COLLOCATION), "masses"),
    "weak-motor, collocation": Row("weak-motor", (COLLOCATION,)),
    "a call of one step, five balls": Row("thesis-hold", (*balls(5), "solver.stepper=rk8"), "call"),
    "64 runs in a batch, rk8, the whole call [ms]": Row(
        "thesis-hold", (SMOOTH, "solver.stepper=rk8"), "batch"
    ),
}


def child(name: str) -> float:
    """The row's number, by the package that is on the path."""
    from ab_sim.batch import simulate_batch
    from ab_sim.drive import Drive
    from ab_sim.scene import load_scene

    row = ROWS[name]
    scene = load_scene(row.scene, row.changes)
    steps, found = round(scene.duration / scene.solver.step) - 1, []
    masses = [{"balls.mass": 1e-3 * (1.0 + 0.08 * i / RUNS)} for i in range(RUNS)]
    for k in range(1 + REPEATS):
        if row.kind == "batch":
            began = time.process_time()
            simulate_batch(scene, masses)
            found.append(1e3 * (time.process_time() - began))
            continue
        if row.kind == "masses":
            more = 1.0 + 0.01 * k
            other = f"balls.mass={1e-3 * more}", f"rotor.total_mass={0.1 * more}"
            scene = load_scene(row.scene, (*row.changes, *other))
        drive = Drive(scene)
        drive.advance(1)
        began = time.process_time()
        calls, taken = (CALLS, 1) if row.kind == "call" else (1, steps)
        for _ in range(calls):
            drive.advance(taken)
        found.append(1e9 * (time.process_time() - began) / (calls * taken))
    return min(found[1:])


def measured(tree: Path, python: str, name: str) -> float:
    """The row's number, in a process of its own."""
    environment = os.environ | {"PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [python, __file__, "--child", name],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    found: float = json.loads(done.stdout)
    return found


def main() -> None:
    """Measure in turns."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tree", type=Path, help="work tree of the former core")
    parser.add_argument("python", help="interpreter that has what it needs")
    parser.add_argument("--only", default="", help="rows whose names have this in them")
    parser.add_argument("--repeats", type=int, default=3, help="turns")
    asked = parser.parse_args()
    own = Path(__file__).resolve().parents[1]
    print("| | old | new | old over new, each time |\n| --- | --- | --- | --- |")
    for name in ROWS:
        if asked.only not in name:
            continue
        turns = [
            (measured(asked.tree, asked.python, name), measured(own, sys.executable, name))
            for _ in range(asked.repeats)
        ]
        old, new = (median(each) for each in zip(*turns, strict=True))
        ratios = ", ".join(f"{a / b:.2f}" for a, b in turns)
        print(f"| {name} | {old:,.4g} | {new:,.4g} | {ratios} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        print(child(sys.argv[2]))
    else:
        main()

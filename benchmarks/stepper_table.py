"""Measure the cost of each stepper at given errors: for one run and for a batch, with compiling.

    python benchmarks/stepper_table.py [--out docs] [--repeats 3]

writes stepper-table.json and prints the table of docs/explanation/steppers.md. Each scene and
stepper runs in a separate process. Errors are the largest of the balls' angles every 5 ms,
against rk8 at a step that is shorter than any other. Times are CPU times. "First" is the first
whole call of a process: scene, drive, machine code and run. "Again" is a drive's run after a reset,
the least of the repeats. "Batch" is the first call of `simulate_batch` with a metric and balls of
different masses, at the setting for 1e-9 rad.
"""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from page_parts import table  # noqa: E402

from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.base.errors import AbSimError  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.design.batch import simulate_batch  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.engine.integrate.registry import parameters_of, steppers  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402

BASE = ["duration=3.2", "start.ball_angles=[0.3, 2.0]"]
SMOOTH = [*BASE, "effects.rolling_friction="]
DRAG = "effects.viscous_drag.coefficient"
SCENES: dict[str, tuple[str, list[str], float]] = {
    "smooth": ("thesis-hold", SMOOTH, 1e-4),
    "friction": ("thesis-hold", BASE, 1e-4),
    "contact": ("packed-balls", ["duration=1"], 1e-4),
    "in space": ("on-edge", ["duration=1"], 5e-5),
    "drag x 10": ("thesis-hold", [*SMOOTH, f"{DRAG}=10"], 1e-4),
    "drag x 100": ("thesis-hold", [*SMOOTH, f"{DRAG}=100"], 2e-5),
    "drag x 10,000": ("thesis-hold", [*SMOOTH, f"{DRAG}=1e4"], 5e-7),
    "drag x 100, friction": ("thesis-hold", [*BASE, f"{DRAG}=100"], 2e-5),
    "stiff mounts": ("thesis-hold", [*SMOOTH, "effects.suspension.stiffness=1e8"], 2e-5),
}
"""Scene, changes and reference's step [s] by the name of the case."""
RUNS = 10_000
"""Runs of a batch."""
GRID = 5e-3
"""Period at which angles are compared [s]."""
STEPS = (5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4)
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)
ERRORS = (1e-6, 1e-9, 1e-12)


def ladder(stepper: str) -> list[list[str]]:
    """Return a stepper's settings from coarse to fine."""
    if "tolerance" in parameters_of(stepper):
        own = [f"solver.stepper={stepper}", "solver.step=0.0025"]
        return [[*own, f"solver.parameters.tolerance={t}"] for t in TOLERANCES]
    return [[f"solver.stepper={stepper}", f"solver.step={h}"] for h in STEPS]


def angles(drive: Drive) -> np.ndarray:
    """Run a drive and return its balls' angles every 5 ms."""
    steps = round(drive.scene.duration / drive.step)
    return np.asarray(drive.advance(steps, round(GRID / drive.step)).ball_angles)


def measure(case: str, stepper: str, repeats: int, reference: np.ndarray | None) -> dict[str, Any]:
    """Return times and errors of a stepper; without a reference, return the reference."""
    scene, changes, finest = SCENES[case]
    if reference is None:
        own = ["solver.stepper=rk8", f"solver.step={finest}"]
        return {"angles": angles(Drive(load_scene(scene, [*changes, *own]))).tolist()}
    row: dict[str, Any] = {}
    for own in ladder(stepper):
        begin = time.process_time()
        try:
            drive = Drive(load_scene(scene, [*changes, *own]))
            error = float(np.abs(angles(drive) - reference).max())
        except AbSimError:  # beyond its stability limit, or unable to handle events
            continue
        row.setdefault("first", time.process_time() - begin)
        again = []
        for _ in range(repeats):
            drive.reset()
            begin = time.process_time()
            angles(drive)
            again.append(time.process_time() - begin)
        for wanted in ERRORS:
            if error <= wanted and f"{wanted:g}" not in row:
                row[f"{wanted:g}"] = {"setting": own, "error": error, "again": min(again)}
        if len(row) == 1 + len(ERRORS):
            break
    if "1e-09" in row:
        base = load_scene(scene, [*changes, *row["1e-09"]["setting"]])
        masses = base.balls.masses[0] * np.linspace(1.0, 1.08, RUNS)
        begin = time.process_time()
        simulate_batch(base, {"balls.mass": masses}, metrics=["residual_unbalance"])
        row["batch"] = time.process_time() - begin
    return row


def in_new_process(what: tuple[str, str, int], reference: Any = None) -> dict[str, Any]:
    """Call ``measure`` in a new process."""
    command = [sys.executable, __file__, "--one", json.dumps(what)]
    text = json.dumps(reference)
    done = subprocess.run(command, input=text, stdout=subprocess.PIPE, text=True, check=True)
    row: dict[str, Any] = json.loads(done.stdout)
    return row


def cells(row: dict[str, Any]) -> list[str]:
    """Return a row of the table; empty cells were not reached or not measured."""
    again = [
        f"{1e3 * row[key]['again']:.2g}" if key in row else "" for key in map("{:g}".format, ERRORS)
    ]
    batch = f"{row['batch']:.3g}" if "batch" in row else ""
    return [row["scene"], f"`{row['stepper']}`", f"{row['first']:.2f}", *again, batch]


def main() -> None:
    """Measure all cases, write the report and print the table."""
    if "--one" in sys.argv:
        angles_wanted = json.load(sys.stdin)
        reference = None if angles_wanted is None else np.array(angles_wanted)
        print(json.dumps(measure(*json.loads(sys.argv[-1]), reference)))
        return
    asked = arguments("Cost of each stepper at given errors.", 3).parse_args()
    # Order 2 reaches none of the errors in reasonable time.
    rows, names = [], [name for name in steppers() if name != "generalized-alpha"]
    for case in SCENES:
        reference = in_new_process((case, "rk8", 1))["angles"]
        for stepper in names:
            row = in_new_process((case, stepper, asked.repeats), reference)
            if row:  # else refused at all settings
                rows.append({"scene": case, "stepper": stepper, **row})
    report = {**conditions(), "clock": "CPU time of the process", "runs": RUNS}
    report |= {"repeats": asked.repeats, "rows": rows}
    write_json(report, str(asked.out / "stepper-table.json"))
    head = ["scene", "stepper", "first [s]", *(f"{e:g} rad [ms]" for e in ERRORS), "batch [s]"]
    print(table(head, [cells(row) for row in rows]))


if __name__ == "__main__":
    main()

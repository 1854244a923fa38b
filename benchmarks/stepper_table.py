"""What each stepper takes to an error: one run, and a batch, with the making of code.

    python benchmarks/stepper_table.py [--out docs] [--only NAME,..]

writes stepper-table.json; `python tools/lines.py` counts lines of methods. Each scene and stepper
has a process of its own. Errors are the largest of the balls' angles every 5 ms, against rk8 at a
step that is shorter than any other; times are CPU times, as others may use the machine. "First" is
the first whole call in a process: scene, drive, machine code, and run. "Again" is a drive's run
after it was reset, the least of some. "Batch" is the first whole call of `simulate_batch` with a
metric, in which runs differ in the balls' masses.
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
from rich.console import Console  # noqa: E402

from ab_sim.batch import simulate_batch  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.errors import AbSimError  # noqa: E402
from ab_sim.integrate.registry import parameters_of, steppers  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.studies.effect_cost import conditions  # noqa: E402

BASE = ["duration=3.2", "start.ball_angles=[0.3, 2.0]"]
SMOOTH = [*BASE, "effects.rolling_friction="]
SCENES: dict[str, tuple[str, list[str], float]] = {
    "smooth": ("thesis-hold", SMOOTH, 1e-4),
    "friction": ("thesis-hold", BASE, 1e-4),
    "contact": ("packed-balls", ["duration=1"], 1e-4),
    "in space": ("on-edge", ["duration=1"], 5e-5),
    "drag x 10": ("thesis-hold", [*SMOOTH, "effects.viscous_drag.coefficient=10"], 1e-4),
    "drag x 100": ("thesis-hold", [*SMOOTH, "effects.viscous_drag.coefficient=100"], 2e-5),
    "drag x 10,000": ("thesis-hold", [*SMOOTH, "effects.viscous_drag.coefficient=1e4"], 5e-7),
    "drag x 100, friction": ("thesis-hold", [*BASE, "effects.viscous_drag.coefficient=100"], 2e-5),
    "stiff mounts": ("thesis-hold", [*SMOOTH, "effects.suspension.stiffness=1e8"], 2e-5),
}
"""Name and settings of each, and the step of its reference [s]."""
BATCHED, RUNS = ("smooth", "friction", "drag x 100", "drag x 10,000"), 1000
GRID = 5e-3
"""s."""
STEPS = (5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4)
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)
REPEATS = 3
ERRORS = (1e-6, 1e-9, 1e-12)


def ladder(stepper: str) -> list[list[str]]:
    """Settings from coarse to fine."""
    if "tolerance" in parameters_of(stepper):
        own = [f"solver.stepper={stepper}", "solver.step=0.0025"]
        return [[*own, f"solver.parameters.tolerance={t}"] for t in TOLERANCES]
    return [[f"solver.stepper={stepper}", f"solver.step={h}"] for h in STEPS]


def angles(drive: Drive) -> np.ndarray:
    """Of the balls, every 5 ms."""
    steps = round(drive.scene.duration / drive.step)
    return np.asarray(drive.advance(steps, round(GRID / drive.step)).ball_angles)


def one(name: str, stepper: str, reference: np.ndarray | None) -> dict[str, Any]:
    """All that is measured of a scene and a stepper, in a process of its own."""
    scene, settings, finest = SCENES[name]
    if reference is None:
        own = ["solver.stepper=rk8", f"solver.step={finest}"]
        return {"angles": angles(Drive(load_scene(scene, [*settings, *own]))).tolist()}
    found: dict[str, Any] = {}
    for own in ladder(stepper):
        begin = time.process_time()
        try:
            drive = Drive(load_scene(scene, [*settings, *own]))
            error = float(np.abs(angles(drive) - reference).max())
        except AbSimError:
            continue
        found.setdefault("first", time.process_time() - begin)
        again = []
        for _ in range(REPEATS):
            drive.reset()
            begin = time.process_time()
            angles(drive)
            again.append(time.process_time() - begin)
        for asked in ERRORS:
            if error <= asked and f"{asked:g}" not in found:
                found[f"{asked:g}"] = {"setting": own, "error": error, "again": min(again)}
        if len(found) == 1 + len(ERRORS):
            break
    if name in BATCHED and "1e-09" in found:
        best = load_scene(scene, [*settings, *found["1e-09"]["setting"]])
        masses = [1e-3 * (1.0 + 0.08 * i / RUNS) for i in range(RUNS)]
        begin = time.process_time()
        simulate_batch(best, {"balls.mass": masses}, merits=["residual_unbalance"])
        found["batch"] = time.process_time() - begin
    return found


def child(name: str, stepper: str, reference: Any = None) -> dict[str, Any]:
    """``one`` in a new process."""
    command = [sys.executable, __file__, "--one", json.dumps([name, stepper])]
    text = json.dumps(reference)
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"failed": done.stderr.strip().splitlines()[-1]}
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def main() -> None:
    """Measure, and write what was found."""
    if "--one" in sys.argv:
        name, stepper = json.loads(sys.argv[-1])
        given = json.load(sys.stdin)
        reference = None if given is None else np.array(given)
        print(json.dumps(one(name, stepper, reference)))
        return
    parser = arguments(__doc__ or "", repeats=1)
    parser.add_argument("--only", default="", help="names of steppers, with commas between")
    given, console = parser.parse_args(), Console(highlight=False)
    rows, names = [], [name for name in steppers() if name != "generalized-alpha"]
    for scene in SCENES:
        reference = child(scene, "rk8")["angles"]
        for stepper in given.only.split(",") if given.only else names:
            row = {"scene": scene, "stepper": stepper, **child(scene, stepper, reference)}
            rows.append(row)
            console.print(json.dumps(row))
    found = {"conditions": conditions(), "runs": RUNS, "rows": rows}
    write_json(found, str(given.out / "stepper-table.json"))


if __name__ == "__main__":
    main()

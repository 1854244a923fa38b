"""Collocation beside Runge and Kutta: error and time of whole runs, all of them in turns.

    python benchmarks/collocation.py [--out docs] [--repeats 9]

writes collocation.json. Runs are of the thesis' start-up with a hold, without friction, and of it
with one thing changed each. The error is the largest in a ball's angle over the run [rad], beside
rk8 at a fifth of its shortest step here or less, whose own error is given: how far it is from
itself at twice the step. CPU time per simulated second is that of ``Drive.advance``, and of the
compiled loop alone, calls included.
"""

import itertools
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.errors import AbSimError  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.spindle.stretches import stretches  # noqa: E402
from ab_sim.studies.effect_cost import Spread, conditions  # noqa: E402

SCENE, SMOOTH, SECONDS, EVERY = "thesis-hold", "effects.rolling_friction=", 6.0, 0.02
CASES: dict[str, tuple[str, ...]] = {
    "thesis-hold": (),
    "five balls": ("balls.count=5", "start.ball_angles=[0.0,0.4,0.8,2.0,3.0]"),
    "drag x 100": ("effects.viscous_drag.coefficient=100",),
    "no drag": ("effects.viscous_drag=",),
    "900 rad/s": (
        "profile.acceleration=900",
        "profile.target_speed=900",
        "profile.variable_speed_period=",
        "spindle.max_speed=900",
        "spindle.max_acceleration=900",
        "start.ball_angles=[0.0,0.5]",
    ),
    "hardening": ("effects.hardening_suspension.cubic_stiffness=1e9",),
    "gravity": ("effects.gravity.tilt=1.5707963",),
    "runout": ("effects.race_runout.offset_1=1e-5", "effects.race_runout.offset_2=0",
               "effects.race_runout.lobe=0", "effects.race_runout.lobe_angle=0"),
    "as shipped": ("effects.rolling_friction.arm=1e-6",),
    "stick-slip": (
        "effects.rolling_friction.arm=3e-4",
        "effects.gravity.tilt=0.32",
        "effects.viscous_drag.coefficient=0.05",
        "profile=",
        "start.speed=30",
        "start.ball_angles=[0.5,2.5]",
    ),
    "packed row": (
        "balls.count=4",
        "balls.mass=5e-4",
        "start.ball_angles=",
        "effects.viscous_drag.coefficient=0.5",
        "effects.rolling_friction.arm=1e-6",
        "effects.ball_contact.restitution_coefficient=0.6",
    ),
}  # fmt: skip
"""What is changed in each."""
METHODS = [("rk8", h, None) for h in (0.005, 0.0025, 0.001)] + [
    ("collocation", h, tolerance)
    for h in (0.02, 0.005, 0.001)
    for tolerance in (1e-7, 1e-9, 1e-11, 1e-13)
]
REFERENCE = {"drag x 100": 2e-5}


class Method(NamedTuple):
    """A stepper with its settings in a case."""

    case: str
    stepper: str
    step: float
    tolerance: float | None


def drive_of(method: Method) -> Drive:
    """A drive of the case."""
    own = [f"solver.stepper={method.stepper}", f"solver.step={method.step}"]
    if method.tolerance is not None:
        own.append(f"solver.parameters.tolerance={method.tolerance}")
    return Drive(load_scene(SCENE, [SMOOTH, *own, *CASES[method.case]]))


def angles(drive: Drive) -> np.ndarray:
    """The balls' angles on the common grid."""
    drive.reset()
    run = drive.advance(round(SECONDS / drive.step))
    every = round(EVERY / drive.step)
    return np.asarray(run.ball_angles[every - 1 :: every])


def whole(drive: Drive) -> None:
    """A run as a user makes it."""
    drive.advance(round(SECONDS / drive.step))


def loop(drive: Drive) -> Callable[[], None]:
    """The same run's calls of the compiled loop."""
    steps = round(SECONDS / drive.step)
    ahead = list(stretches(drive.profile, drive._grid(), 0, steps))
    rows = [drive._empty_rows(max(stretch.steps, 1)) for stretch in ahead]

    def run() -> None:
        for stretch, part in zip(ahead, rows, strict=True):
            drive._integrate(stretch, part)

    return run


def cpu(drive: Drive, run: Callable[[], None]) -> float:
    """Of one run [us per simulated second]."""
    drive.reset()
    begin = time.thread_time_ns()
    run()
    return (time.thread_time_ns() - begin) / SECONDS / 1e3


def measure(case: str, repeats: int, say: Callable[[str], None]) -> list[dict[str, Any]]:
    """All methods in a case, in turns."""
    step = REFERENCE.get(case, 2e-4)
    true, check = (angles(drive_of(Method(case, "rk8", h, None))) for h in (step, 2 * step))
    drives, rows = {}, []
    for settings in METHODS:
        method = Method(case, *settings)
        try:
            drives[method] = drive_of(method)
            error = float(np.abs(angles(drives[method]) - true).max())
        except AbSimError as refused:
            drives.pop(method, None)
            say(f"{case}: {method.stepper} at {method.step} s: {refused}"[:110])
            continue
        rows.append({**method._asdict(), "error": error})
    times: dict[Any, list[float]] = {}
    for _, (method, drive) in itertools.product(range(repeats), drives.items()):
        times.setdefault((method, "run"), []).append(cpu(drive, lambda d=drive: whole(d)))
        times.setdefault((method, "loop"), []).append(cpu(drive, loop(drive)))
    for method, row in zip(drives, rows, strict=True):
        for name in ("run", "loop"):
            row[f"{name}_us"] = Spread.of(np.array(times[method, name]))._asdict()
        row["reference_error"] = float(np.abs(true - check).max())
        say(
            f"{case}: {method.stepper} {1e3 * method.step:g} ms"
            + (f", {method.tolerance:g}" if method.tolerance else "")
            + f": {row['error']:.1e} rad, {row['run_us']['median']:.0f} us per s, "
            f"loop {row['loop_us']['median']:.0f}"
        )
    return rows


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Error and time of collocation and Runge-Kutta.", 9)
    parser.add_argument("--case", action="append", choices=[*CASES], help="only these")
    asked = parser.parse_args()
    console = Console(markup=False, highlight=False, soft_wrap=True)
    rows = [
        row for case in asked.case or CASES for row in measure(case, asked.repeats, console.print)
    ]
    report = {**conditions(), "scene": SCENE, "repeats": asked.repeats, "rows": rows}
    write_json(report, str(asked.out / "collocation.json"))


if __name__ == "__main__":
    main()

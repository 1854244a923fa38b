"""Collocation beside Runge and Kutta: error and time of whole runs, all of them in turns.

    python benchmarks/collocation.py [--out docs] [--repeats 9]

writes collocation.json. Runs are of the thesis' start-up with a hold, without friction, and of it
with one thing changed each, and of decks in space. The error is the largest in a ball's angle over
the run [rad], beside rk8 at a fifth of its shortest step here or less, whose own error is given:
how far it is from itself at twice the step. CPU time per simulated second is that of
``Drive.advance``, and of the compiled loop alone, calls included.

Live: what a wake-up takes that advances the drive by four samples 1 ms apart and follows a new
command, all wake-ups in turns.
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
from ab_sim.studies.effect_cost import Quartiles, conditions  # noqa: E402

EVERY = 0.02
LIVE, WAKES, PER_WAKE = ("thesis-hold", "as shipped", "five balls", "feeding-deck"), 5000, 4


class Case(NamedTuple):
    """A scene, with what is changed in it."""

    changes: tuple[str, ...] = ()
    scene: str = "thesis-hold"
    seconds: float = 6.0

    @property
    def all_changes(self) -> list[str]:
        """The thesis' friction is left out, but where it is named anew."""
        smooth = ["effects.rolling_friction="] if self.scene == "thesis-hold" else []
        return [*smooth, *self.changes]


MOTOR = (
    "effects.motor.rotor_inertia=2.9e-5",
    "effects.motor.torque_limit=1",
    "effects.motor.proportional_gain=2e-3",
    "effects.motor.integral_gain=0.02",
    "effects.motor.back_emf_slope=1e-5",
)
RUNOUT = ("effects.race_runout.offset_1=1e-5", "effects.race_runout.offset_2=0",
          "effects.race_runout.lobe=0", "effects.race_runout.lobe_angle=0")  # fmt: skip
UNEQUAL = (
    "effects.suspension=",
    "effects.unequal_suspension.stiffness_1=1000",
    "effects.unequal_suspension.stiffness_2=1500",
    "effects.unequal_suspension.damping_1=0.2",
    "effects.unequal_suspension.damping_2=0.2",
    "effects.unequal_suspension.axis_angle=0.3",
)
FAST = (
    "profile.acceleration=900",
    "profile.target_speed=900",
    "profile.variable_speed_period=",
    "spindle.max_speed=900",
    "spindle.max_acceleration=900",
    "start.ball_angles=[0.0,0.5]",
)
STICK_SLIP = (
    "effects.rolling_friction.arm=3e-4",
    "effects.gravity.tilt=0.32",
    "effects.viscous_drag.coefficient=0.05",
    "profile=",
    "start.speed=30",
    "start.ball_angles=[0.5,2.5]",
)
ROW = (
    "balls.count=4",
    "balls.mass=5e-4",
    "start.ball_angles=",
    "effects.viscous_drag.coefficient=0.5",
    "effects.rolling_friction.arm=1e-6",
    "effects.ball_contact.restitution_coefficient=0.6",
)
CASES: dict[str, Case] = {
    "thesis-hold": Case(),
    "five balls": Case(("balls.count=5", "start.ball_angles=[0.0,0.4,0.8,2.0,3.0]")),
    "drag x 100": Case(("effects.viscous_drag.coefficient=100",)),
    "no drag": Case(("effects.viscous_drag=",)),
    "900 rad/s": Case(FAST),
    "hardening": Case(("effects.hardening_suspension.cubic_stiffness=1e9",)),
    "gravity": Case(("effects.gravity.tilt=1.5707963",)),
    "unequal": Case(UNEQUAL),
    "runout": Case(RUNOUT),
    "motor": Case(MOTOR),
    "feeding-deck": Case((), "feeding-deck", 4.0),
    "feeding-deck on edge": Case(
        (
            "effects.gravity.tilt=1.5707963",
            "effects.hardening_suspension.cubic_stiffness=1e8",
            "start.deck.tilt=[0.01,-0.02,0.01]",
        ),
        "feeding-deck",
        4.0,
    ),
    "couple-unbalance": Case((), "couple-unbalance", 6.0),
    "as shipped": Case(("effects.rolling_friction.arm=1e-6",)),
    "stick-slip": Case(STICK_SLIP),
    "packed row": Case(ROW),
    "motor at its limit": Case((*MOTOR, "effects.motor.torque_limit=2e-3")),
}
"""What is changed in each; a deck in space has no friction."""
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


def changes_of(method: Method) -> list[str]:
    """Of the case's scene."""
    own = [f"solver.stepper={method.stepper}", f"solver.step={method.step}"]
    if method.tolerance is not None:
        own.append(f"solver.parameters.tolerance={method.tolerance}")
    return [*own, *CASES[method.case].all_changes]


def drive_of(method: Method) -> Drive:
    """A drive of the case."""
    return Drive(load_scene(CASES[method.case].scene, changes_of(method)))


def angles(drive: Drive, seconds: float) -> np.ndarray:
    """The balls' angles on the common grid."""
    drive.reset()
    run = drive.advance(round(seconds / drive.step))
    every = round(EVERY / drive.step)
    return np.asarray(run.ball_angles[every - 1 :: every])


def whole(drive: Drive, seconds: float) -> None:
    """A run as a user makes it."""
    drive.advance(round(seconds / drive.step))


def loop(drive: Drive, seconds: float) -> Callable[[], None]:
    """The same run's calls of the compiled loop."""
    steps = round(seconds / drive.step)
    samples = drive._room_for(steps)
    samples[:] = 0.0
    return lambda: drive._take(drive._step_plan, steps, samples)


def cpu(drive: Drive, run: Callable[[], None], seconds: float) -> float:
    """Of one run [us per simulated second]."""
    drive.reset()
    begin = time.thread_time_ns()
    run()
    return (time.thread_time_ns() - begin) / seconds / 1e3


def measure(case: str, repeats: int, say: Callable[[str], None]) -> list[dict[str, Any]]:
    """All methods in a case, in turns."""
    step, seconds = REFERENCE.get(case, 2e-4), CASES[case].seconds
    true, check = (
        angles(drive_of(Method(case, "rk8", h, None)), seconds) for h in (step, 2 * step)
    )
    drives, rows = {}, []
    for settings in METHODS:
        method = Method(case, *settings)
        try:
            drives[method] = drive_of(method)
            error = float(np.abs(angles(drives[method], seconds) - true).max())
        except AbSimError as refused:
            drives.pop(method, None)
            say(f"{case}: {method.stepper} at {method.step} s: {refused}"[:110])
            continue
        rows.append({**method._asdict(), "error": error})
    times: dict[Any, list[float]] = {}
    for _, (method, drive) in itertools.product(range(repeats), drives.items()):
        one = cpu(drive, lambda d=drive: whole(d, seconds), seconds)
        times.setdefault((method, "run"), []).append(one)
        one = cpu(drive, loop(drive, seconds), seconds)
        times.setdefault((method, "loop"), []).append(one)
    for method, row in zip(drives, rows, strict=True):
        for name in ("run", "loop"):
            row[f"{name}_us"] = Quartiles.of(np.array(times[method, name]))._asdict()
        row["reference_error"] = float(np.abs(true - check).max())
        say(
            f"{case}: {method.stepper} {1e3 * method.step:g} ms"
            + (f", {method.tolerance:g}" if method.tolerance else "")
            + f": {row['error']:.1e} rad, {row['run_us']['median']:.0f} us per s, "
            f"loop {row['loop_us']['median']:.0f}"
        )
    return rows


def live(case: str) -> list[dict[str, Any]]:
    """Quantiles of a wake-up's time [us], for rk8 and collocation."""
    methods = [Method(case, "rk8", 1e-3, None), Method(case, "collocation", 1e-3, 1e-9)]
    drives = [Drive(load_scene(CASES[case].scene, changes_of(m)), commanded=True) for m in methods]
    speeds, times = np.random.default_rng(1).uniform(40.0, 160.0, WAKES), np.empty((WAKES, 2))
    for k, speed in enumerate(speeds):
        for which, drive in enumerate(drives):
            begin = time.perf_counter_ns()
            drive.command(float(speed))
            drive.advance(PER_WAKE)
            times[k, which] = 1e-3 * (time.perf_counter_ns() - begin)
    shares = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "worst": 1.0}
    return [
        {
            "case": case,
            "stepper": method.stepper,
            **{name: float(np.quantile(times[:, which], q)) for name, q in shares.items()},
        }
        for which, method in enumerate(methods)
    ]


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Error and time of collocation and Runge-Kutta.", 9)
    parser.add_argument("--case", action="append", choices=[*CASES], help="only these")
    asked = parser.parse_args()
    console = Console(markup=False, highlight=False, soft_wrap=True)
    rows = [
        row for case in asked.case or CASES for row in measure(case, asked.repeats, console.print)
    ]
    wakes = [row for case in LIVE if case in (asked.case or CASES) for row in live(case)]
    report = {**conditions(), "repeats": asked.repeats, "rows": rows, "live": wakes}
    write_json(report, str(asked.out / "collocation.json"))


if __name__ == "__main__":
    main()

"""CPU time of runs with friction, contact or a motor: in a batch, and one by one.

    python benchmarks/batch_over_events.py [--out docs] [--repeats 7] [--many RUNS]

writes batch-over-events.json. "One by one": a scene, a Drive and its metrics for each run;
"batch": the whole call of `simulate_batch` with the same metrics, those of a sweep. Both are
measured in this process in turns, and the ratio is that of each turn. Steps are 1 ms, as in the
scenes; values are random. Kernels are compiled beforehand. Accelerometers are left out, because
their noise takes the same time in both.

``--many`` runs that number of friction start-ups of 6 s once: two processes, half of the runs each,
at 1 ms and at 2.5 ms; errors are against steps of 0.25 ms. Memory is that of one process.
"""

import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.effect_cost import Quartiles, conditions  # noqa: E402
from ab_sim.analysis.metrics import metrics_of  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.design.batch import Batch, simulate_batch  # noqa: E402
from ab_sim.design.batch.prepared_run import steps_of  # noqa: E402
from ab_sim.design.batch.simulate import values_of_runs, varied_scene  # noqa: E402
from ab_sim.design.sweep import DEFAULT_METRICS  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402

PROCESSES, FRICTION = 2, "balanced-start-up"
STEPS, REFERENCE_STEP, COMPARED, APART = (1e-3, 2.5e-3), 2.5e-4, 64, 0.03
"""Steps [s], reference step [s], number of compared runs, and time between comparisons [s]."""
SILENT = ["sensors="]
Columns = dict[str, Any]


class Kind(NamedTuple):
    """Scenes to run."""

    scene: str
    has: str
    runs: int
    drawn: Callable[[int, np.random.Generator], Columns]
    goal: float
    changes: Sequence[str] = ()


def anywhere(runs: int, random: np.random.Generator) -> Columns:
    """Return random start angles of the balls."""
    return {"start.ball_angles": random.uniform(-np.pi, np.pi, (runs, 2))}


def apart(runs: int, random: np.random.Generator) -> Columns:
    """Return random start angles of the balls without overlaps."""
    first = random.uniform(-np.pi, np.pi, runs)
    return {"start.ball_angles": np.stack([first, first + random.uniform(0.5, 5.5, runs)], 1)}


def masses(runs: int, random: np.random.Generator) -> Columns:
    """Return random masses of all balls."""
    return {"balls.mass": random.uniform(2.2e-4, 2.8e-4, runs)}


def limits(runs: int, random: np.random.Generator) -> Columns:
    """Return random torque limits: some drives are caught at the critical speed, others pass it."""
    return {"effects.motor.torque_limit": random.uniform(4e-4, 2e-3, runs)}


KINDS = [
    Kind(FRICTION, "friction, 2 balls", 512, anywhere, 5.0),
    Kind("thesis-hold", "friction, 2 balls", 512, anywhere, 5.0),
    Kind("weak-motor", "a motor, 2 balls", 256, limits, 2.0),
    Kind("on-edge", "friction, contact, 2 balls", 128, apart, 2.0, SILENT),
    Kind("everything", "friction, contact, a motor, 2 balls", 64, apart, 2.0, SILENT),
    Kind("packed-balls", "friction, contact, 8 balls", 64, masses, 2.0),
]


def one_by_one(scene: Scene, columns: Columns) -> int:
    """Run and judge one by one; return the number of events."""
    events = 0
    for number, variation in enumerate(values_of_runs(columns)):
        own = varied_scene(scene, variation, number)
        drive = Drive(own)
        metrics_of(drive.advance(steps_of(own)), own, DEFAULT_METRICS).report()
        events += drive.events
    return events


def batch(scene: Scene, columns: Columns) -> Batch:
    """Run and judge in a batch."""
    done = simulate_batch(scene, columns, metrics=DEFAULT_METRICS)
    assert not any(done.failures) and done.in_lanes == len(done)
    return done


def compare(repeats: int) -> list[dict[str, Any]]:
    """Measure all kinds in turns."""
    given = []
    for kind in KINDS:
        columns = kind.drawn(kind.runs, np.random.default_rng(1))
        given.append((kind, load_scene(kind.scene, kind.changes), columns))
    found: list[list[tuple[float, float, float]]] = [[] for _ in given]
    events = [0] * len(given)
    for repeat in range(-1, repeats):
        for k, (kind, scene, columns) in enumerate(given):
            if repeat < 0:  # compiles what is not there yet
                columns = {key: values[:8] for key, values in columns.items()}
            begin = time.process_time()
            events[k] = one_by_one(scene, columns)
            middle = time.process_time()
            done = batch(scene, columns)
            end = time.process_time()
            if repeat >= 0:
                times = middle - begin, end - middle, done.integration_seconds
                found[k].append(tuple(each / kind.runs for each in times))
    rows = []
    for (kind, scene, _), times, count in zip(given, found, events, strict=True):
        alone, whole, kernel = np.array(times).T
        spreads = {"one_by_one": alone, "batch": whole, "kernel": kernel, "ratio": alone / whole}
        spread = {name: Quartiles.of(values)._asdict() for name, values in spreads.items()}
        about = {"scene": kind.scene, "has": kind.has, "runs": kind.runs, "goal": kind.goal}
        steps = steps_of(scene)
        rows.append({**about, "steps": steps, "events": count / kind.runs, **spread})
    return rows


def friction_scene(step: float) -> Scene:
    """Return a friction start-up of 6 s with an integration step [s]."""
    return load_scene(FRICTION, [f"solver.step={step}", "duration=6"])


def error(step: float) -> float:
    """Return the largest error in a ball's angle [rad]."""
    columns = anywhere(COMPARED, np.random.default_rng(2))

    def angles(step: float) -> np.ndarray:
        runs = simulate_batch(friction_scene(step), columns, every=round(APART / step)).runs
        return np.array([run.trajectory.ball_angles for run in runs])

    return float(np.abs(angles(step) - angles(REFERENCE_STEP)).max())


def part_of_many(seed: int, step: float, runs: int) -> tuple[float, int, int]:
    """Run the share of one process; return CPU time [s], failures and peak memory [kB]."""
    scene, columns = friction_scene(step), anywhere(runs, np.random.default_rng(seed))
    begin = time.process_time()
    done = batch(scene, columns)
    spent = time.process_time() - begin
    return spent, sum(map(bool, done.failures)), getrusage(RUSAGE_SELF).ru_maxrss


def many(step: float, runs: int) -> dict[str, Any]:
    """Run many runs in parallel processes, including their start."""
    begin, share = time.perf_counter(), [runs // PROCESSES] * PROCESSES
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        parts = list(pool.map(part_of_many, range(PROCESSES), [step] * PROCESSES, share))
    seconds = time.perf_counter() - begin
    spent, failures, memory = np.array(parts).T
    return {
        "runs": sum(share),
        "step": step,
        "error": error(step),
        "processes": PROCESSES,
        "seconds": seconds,
        "cpu_seconds": spent.sum(),
        "failures": int(failures.sum()),
        "memory_mb": memory.max() / 1024,
        "a_million_would_take": spent.sum() / PROCESSES * 1e6 / sum(share),
    }


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Cost of runs with events in a batch.", 7)
    parser.add_argument("--many", type=int, metavar="RUNS", help="run so many start-ups, too")
    asked = parser.parse_args()
    report: dict[str, Any] = {
        **conditions(),
        "metrics": DEFAULT_METRICS,
        "repeats": asked.repeats,
        "rows": compare(asked.repeats),
    }
    if asked.many:
        report["many"] = [many(step, asked.many) for step in STEPS]
    write_json(report, str(asked.out / "batch-over-events.json"))
    console = Console(markup=False, highlight=False, soft_wrap=True)
    for row in report["rows"]:
        ratio = row["ratio"]
        console.print(
            f"{row['scene']} ({row['has']}; {row['events']:.0f} events in {row['steps']} steps): "
            f"{1e3 * row['one_by_one']['median']:.2f} ms one by one, "
            f"{1e3 * row['batch']['median']:.2f} ms in a batch, of which the kernel "
            f"{1e3 * row['kernel']['median']:.2f}; {ratio['median']:.2f} times as many "
            f"({ratio['lower']:.2f} to {ratio['upper']:.2f}; goal: {row['goal']:g})"
        )
    for each in report.get("many", []):
        console.print(
            f"{each['runs']:,} friction start-ups of 6 s at {1e3 * each['step']:g} ms, error "
            f"{each['error']:.1e} rad: {each['seconds']:.0f} s in {PROCESSES} processes, "
            f"{each['cpu_seconds']:.0f} CPU s, {each['memory_mb']:.0f} MB; a million would take "
            f"{each['a_million_would_take'] / 60:.1f} min of CPU time in each"
        )


if __name__ == "__main__":
    main()

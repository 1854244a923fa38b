"""CPU time of runs with friction, contact or a motor: in a batch, and one by one.

    python benchmarks/batch_over_events.py [--out docs] [--repeats 7]

writes batch-over-events.json. "One by one": a scene, a Drive and its metrics for each run;
"batch": the whole call of `simulate_batch` with the same metrics, those of a sweep. Both are
measured in this process in turns, and the ratio is that of each turn. Steps are 1 ms, as in the
scenes; values are random. Kernels are compiled beforehand. Accelerometers are left out, because
their noise takes the same time in both.
"""

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
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
    Kind("balanced-start-up", "friction, 2 balls", 512, anywhere, 5.0),
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


def main() -> None:
    """Measure and write the file."""
    asked = arguments("Cost of runs with events in a batch.", 7).parse_args()
    report: dict[str, Any] = {
        **conditions(),
        "metrics": DEFAULT_METRICS,
        "repeats": asked.repeats,
        "rows": compare(asked.repeats),
    }
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


if __name__ == "__main__":
    main()

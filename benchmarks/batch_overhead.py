"""CPU time of many judged runs, from parameters to metrics, relative to that of their kernel.

    python benchmarks/batch_overhead.py [--out docs] [--repeats 7] [--runs 10000] [--million]

writes batch-overhead.json. The runs are the thesis' start-up with a hold, two balls, no friction,
6 s, with random values of the balls' mass, drag and stiffness. "Whole" is the CPU time of a call of
`simulate_batch` with the metrics of a sweep. "Kernel" is the part of it for steps and samples. The
ratio is taken within each call, and the kinds of calls alternate.

- arrays: values as an array for each key
- mappings: values as a mapping for each run
- own scenes: a key varies that needs a scene for each run, the speed at the start; a tenth of the
  runs
- samples, too: samples are kept in addition to metrics; a tenth of the runs

``--million`` runs a million of them once, at 6 ms, whose error is below 1e-6 rad (see
batch-throughput.json): two processes, half of the runs each.
"""

import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.effect_cost import Quartiles, conditions  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.design.batch import Batch, simulate_batch  # noqa: E402
from ab_sim.design.sweep import DEFAULT_METRICS  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402

SCENE, CHANGES = "thesis-hold", ["effects.rolling_friction=", "solver.stepper=rk8", "duration=6"]
STEPS = (1e-3, 5e-3, 6e-3)
"""Integration steps [s]."""
RANGES = {
    "balls.mass": (0.9e-3, 1.1e-3),
    "effects.viscous_drag.coefficient": (0.8, 1.2),
    "effects.suspension.stiffness": (900.0, 1100.0),
}
GOAL, MILLION, PROCESSES = 1.25, 1_000_000, 2


def scene_of(step: float) -> Scene:
    """Return the scene with an integration step [s]."""
    return load_scene(SCENE, [*CHANGES, f"solver.step={step}"])


def drawn(runs: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Return random values for each run, by key."""
    random = np.random.default_rng(seed)
    return {key: random.uniform(low, high, runs) for key, (low, high) in RANGES.items()}


def arrays(scene: Scene, runs: int) -> Callable[[], Batch]:
    """Return a call with values as arrays."""
    values = drawn(runs)
    return lambda: simulate_batch(scene, values, metrics=DEFAULT_METRICS)


def mappings(scene: Scene, runs: int) -> Callable[[], Batch]:
    """Return a call with values as mappings."""
    lists = {key: values.tolist() for key, values in drawn(runs).items()}
    rows = [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]
    return lambda: simulate_batch(scene, rows, metrics=DEFAULT_METRICS)


def own_scenes(scene: Scene, runs: int) -> Callable[[], Batch]:
    """Return a call with a key that needs a scene for each run."""
    values = drawn(runs // 10)
    values["start.speed"] = np.random.default_rng(2).uniform(0.0, 1.0, runs // 10)
    return lambda: simulate_batch(scene, values, metrics=DEFAULT_METRICS)


def with_samples(scene: Scene, runs: int) -> Callable[[], Batch]:
    """Return a call that keeps every hundredth sample."""
    values = drawn(runs // 10)
    return lambda: simulate_batch(scene, values, every=100, metrics=DEFAULT_METRICS, samples=True)


KINDS = {
    "arrays": arrays,
    "mappings": mappings,
    "own scenes": own_scenes,
    "samples, too": with_samples,
}


class Cost(NamedTuple):
    """CPU time of a call per run [s]."""

    whole: float
    kernel: float


def cost(call: Callable[[], Batch]) -> Cost:
    """Measure one call."""
    begin = time.process_time()
    batch = call()
    whole = time.process_time() - begin
    assert not any(batch.failures)
    return Cost(whole / len(batch), batch.integration_seconds / len(batch))


def compare(repeats: int, runs: int) -> list[dict[str, Any]]:
    """Measure all kinds of calls in turns."""
    calls = {
        (kind, step): made(scene_of(step), runs) for kind, made in KINDS.items() for step in STEPS
    }
    for kind, step in calls:  # compiles what is not there yet
        KINDS[kind](scene_of(step), 160)()
    found: dict[Any, list[Cost]] = {each: [] for each in calls}
    for _ in range(repeats):
        for each, call in calls.items():
            found[each].append(cost(call))
    rows = []
    for (kind, step), costs in found.items():
        whole, kernel = np.array(costs).T
        spreads = {"whole": whole, "kernel": kernel, "ratio": whole / kernel}
        spread = {name: Quartiles.of(values)._asdict() for name, values in spreads.items()}
        rows.append({"kind": kind, "step": step, **spread})
    return rows


def part_of_a_million(seed: int) -> tuple[float, float, float, int]:
    """Run the share of one process: CPU time of call and kernel [s], peak memory [B], failures."""
    call = scene_of(STEPS[-1]), drawn(MILLION // PROCESSES, seed)
    begin = time.process_time()
    batch = simulate_batch(*call, metrics=DEFAULT_METRICS)
    whole = time.process_time() - begin
    return whole, batch.integration_seconds, peak_memory(), sum(map(bool, batch.failures))


def peak_memory() -> float:
    """Return the peak memory of this process [B].

    The value of getrusage may be that of the parent process.
    """
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(1024.0 * float(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def a_million() -> dict[str, Any]:
    """Run a million runs in parallel processes, including their start."""
    begin = time.perf_counter()
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        parts = list(pool.map(part_of_a_million, range(PROCESSES)))
    seconds = time.perf_counter() - begin
    whole, kernel, memory, failures = np.array(parts).T
    return {
        "runs": MILLION,
        "step": STEPS[-1],
        "processes": PROCESSES,
        "seconds": seconds,
        "cpu_seconds": whole.sum(),
        "kernel_seconds": kernel.sum(),
        "ratio": whole.sum() / kernel.sum(),
        "memory": memory.sum(),
        "failures": int(failures.sum()),
    }


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Cost of many judged runs beside their kernel.", 7)
    parser.add_argument("--runs", type=int, default=10_000, help="of a call")
    parser.add_argument("--million", action="store_true", help="run a million, too")
    asked = parser.parse_args()
    report: dict[str, Any] = {
        **conditions(),
        "scene": SCENE,
        "changes": CHANGES,
        "ranges": RANGES,
        "metrics": DEFAULT_METRICS,
        "runs": asked.runs,
        "repeats": asked.repeats,
        "goal": GOAL,
        "rows": compare(asked.repeats, asked.runs),
    }
    if asked.million:
        report["million"] = a_million()
    write_json(report, str(asked.out / "batch-overhead.json"))
    console = Console(markup=False, highlight=False, soft_wrap=True)
    for row in report["rows"]:
        ratio, whole, kernel = row["ratio"], row["whole"]["median"], row["kernel"]["median"]
        console.print(
            f"{row['kind']}, {1e3 * row['step']:g} ms: {ratio['median']:.3f} times the kernel "
            f"({ratio['lower']:.3f} to {ratio['upper']:.3f}; goal: {GOAL}); per run "
            f"{1e6 * whole:.0f} us, kernel {1e6 * kernel:.0f} us"
        )
    if asked.million:
        all_ = report["million"]
        console.print(
            f"a million at {1e3 * all_['step']:g} ms: {all_['seconds']:.0f} s in "
            f"{PROCESSES} processes, {all_['ratio']:.3f} times the kernel, "
            f"{all_['memory'] / 1e6:.0f} MB"
        )


if __name__ == "__main__":
    main()

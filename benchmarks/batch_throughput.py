"""Simulated time per CPU time of many runs in a batch, and of successive single runs.

    python benchmarks/batch_throughput.py [--out docs] [--repeats 31]

writes batch-throughput.json and batch-throughput.png. The runs are the thesis' start-up with a
hold, two balls, no friction, with different ball masses, side by side. "One by one" is the compiled
loop of one run with its call. "Kernel" are the loops of the batch. "Whole call" is `simulate_batch`
with its checks of every scene and its trajectories, with all steps, or with the last step only. All
of these are measured in turns. Errors are against rk8 at 0.25 ms, at every step.
"""

import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.effect_cost import Quartiles, conditions  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.design.batch import simulate_batch  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.drive.accuracy.trials import Deviation, Samples, deviation  # noqa: E402
from ab_sim.engine.stepping.side_by_side import LANES  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402

SCENE, SMOOTH = "thesis-hold", "effects.rolling_friction="
RUNS = 25 * LANES
REFERENCE_STEP = 2.5e-4
"""Step of the reference [s]; it divides all steps, so that all of them are compared."""
VARIATIONS: list[dict[str, Any]] = [
    {"balls.mass": 1e-3 * (1.0 + 0.08 * i / RUNS)} for i in range(RUNS)
]
COMPARED = slice(None, None, RUNS // LANES)
"""Runs whose errors are computed."""
GOALS = {"kernel": 60_000.0, "whole_call": 10_000.0}
ERROR = 1e-9


class Method(NamedTuple):
    """Stepper with its settings."""

    stepper: str
    step: float
    """Integration step [s]."""
    tolerance: float | None = None
    """Tolerance [rad]."""

    @property
    def said(self) -> str:
        """Return the name of the method."""
        tolerance = "" if self.tolerance is None else f", tolerance {self.tolerance:g}"
        return f"{self.stepper}, {1e3 * self.step:g} ms{tolerance}"


METHODS = [
    *(Method("rk8", step) for step in (6e-3, 5e-3, 3.75e-3, 2.5e-3)),
    *(Method("taylor", 5e-3, tolerance) for tolerance in (1e-7, 1e-9, 1e-11)),
]


def scene_of(method: Method) -> Scene:
    """Return the scene with a method."""
    own = [SMOOTH, f"solver.stepper={method.stepper}", f"solver.step={method.step}"]
    if method.tolerance is not None:
        own.append(f"solver.parameters.tolerance={method.tolerance}")
    return load_scene(SCENE, own)


def errors(method: Method) -> Deviation:
    """Return the largest errors over some runs of the batch."""
    found, compared = [], VARIATIONS[COMPARED]
    runs = simulate_batch(scene_of(method), compared).runs
    references = simulate_batch(scene_of(Method("rk8", REFERENCE_STEP)), compared).runs
    for run, reference in zip(runs, references, strict=True):
        ours, truth = Samples.of(run.trajectory), Samples.of(reference.trajectory)
        found.append(deviation(ours, truth, run.scene.whirl_unit[0]))
    return Deviation(*(max(part) for part in zip(*found, strict=True)))


class Alone:
    """Compiled loop of a single run, with its call."""

    def __init__(self, scene: Scene) -> None:
        self._drive, self._steps = Drive(scene), round(scene.duration / scene.solver.step)
        self._samples = self._drive._room_for(self._steps)

    def run(self) -> float:
        """Run from start to end; return the CPU time [s]."""
        self._drive.reset()
        begin = time.thread_time()
        self._drive._take(self._drive._step_plan, self._steps, self._samples)
        return time.thread_time() - begin


class Measured(NamedTuple):
    """Simulated seconds per CPU second for each repeat."""

    one_by_one: list[float]
    kernel: list[float]
    whole_call: list[float]
    last_kernel: list[float]
    """Values if only the last step is kept."""
    last_whole_call: list[float]


def measure(scene: Scene, alone: Alone, into: Measured) -> None:
    """Measure each kind once."""
    into.one_by_one.append(scene.duration / alone.run())
    steps = round(scene.duration / scene.solver.step)
    kinds = (1, into.kernel, into.whole_call), (steps, into.last_kernel, into.last_whole_call)
    for every, kernel, whole in kinds:
        begin = time.thread_time()
        batch = simulate_batch(scene, VARIATIONS, every)
        whole.append(RUNS * scene.duration / (time.thread_time() - begin))
        kernel.append(RUNS * scene.duration / batch.integration_seconds)


def compare(repeats: int) -> list[dict[str, Any]]:
    """Measure all methods in turns."""
    scenes = {method: scene_of(method) for method in METHODS}
    alone = {method: Alone(scene) for method, scene in scenes.items()}
    found = {method: Measured([], [], [], [], []) for method in METHODS}
    for repeat in range(-1, repeats):
        for method, scene in scenes.items():
            # The first time compiles what is not there yet.
            into = Measured([], [], [], [], []) if repeat < 0 else found[method]
            measure(scene, alone[method], into)
    rows = []
    for method, measured in found.items():
        numbers = {name: np.array(values) for name, values in measured._asdict().items()}
        ratio = Quartiles.of(numbers["kernel"] / numbers["one_by_one"])
        spreads = {name: Quartiles.of(values)._asdict() for name, values in numbers.items()}
        error = errors(method)._asdict()
        rows.append({**method._asdict(), "error": error, **spreads, "ratio": ratio._asdict()})
    return rows


def name_of(row: dict[str, Any]) -> str:
    """Return the name of a row's method."""
    return Method(row["stepper"], row["step"], row["tolerance"]).said


def figure(report: dict[str, Any], path: Path) -> None:
    """Draw bars for each method: one by one, whole call, kernel."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows, names = report["rows"], ("one_by_one", "whole_call", "kernel")
    made, axes = plt.subplots(figsize=(9, 1 + 0.75 * len(rows)), constrained_layout=True)
    for k, (name, colour) in enumerate(zip(names, ("0.5", "tab:orange", "tab:red"), strict=True)):
        medians = np.array([row[name]["median"] for row in rows])
        low = medians - [row[name]["lower"] for row in rows]
        high = [row[name]["upper"] for row in rows] - medians
        places = np.arange(len(rows)) + 0.26 * (k - 1)
        label = name.replace("_", " ")
        axes.barh(
            places, medians, height=0.24, xerr=[low, high], color=colour, capsize=3, label=label
        )
        for place, value, end in zip(places, medians, medians + high, strict=True):
            axes.text(end, place, f"   {value:,.0f}", va="center", fontsize=8)
    for name, goal in GOALS.items():
        said = f"goal of the {name.replace('_', ' ')}: {goal:,.0f} at {ERROR:g} rad"
        axes.axvline(goal, color="0.3", linestyle=":" if name == "kernel" else "--", label=said)
    labels = [
        f"{name_of(row)}\n{row['error']['angle']:.0e} rad over the run,\n"
        f"{row['error']['angle_end']:.0e} rad at its end"
        for row in rows
    ]
    axes.set_yticks(range(len(rows)), labels, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("simulated seconds per CPU second, one core")
    axes.margins(x=0.15)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.4, -0.14), ncols=3)
    try:
        made.savefig(path, dpi=120)
    finally:
        plt.close(made)


def main() -> None:
    """Measure and write the two files."""
    asked = arguments("Throughput of runs in a batch.", 31).parse_args()
    rows = compare(asked.repeats)
    report = {
        **conditions(),
        "scene": SCENE,
        "changes": [SMOOTH],
        "runs": RUNS,
        "repeats": asked.repeats,
        "goal": {**GOALS, "error": ERROR},
        "rows": rows,
    }
    write_json(report, str(asked.out / "batch-throughput.json"))
    figure(report, asked.out / "batch-throughput.png")
    console = Console(markup=False, highlight=False, soft_wrap=True)
    for row in rows:
        console.print(
            f"{name_of(row)}: {row['error']['angle']:.1e} rad over the run "
            f"({row['error']['angle_end']:.1e} at its end): {row['kernel']['median']:,.0f} "
            f"simulated s per CPU s in the kernel, {row['ratio']['median']:.2f} times one by one "
            f"({row['ratio']['lower']:.2f} to {row['ratio']['upper']:.2f}); whole call "
            f"{row['whole_call']['median']:,.0f}; of the last step only "
            f"{row['last_kernel']['median']:,.0f} and {row['last_whole_call']['median']:,.0f}"
        )


if __name__ == "__main__":
    main()

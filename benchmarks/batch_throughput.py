"""Simulated time per CPU time of many runs side by side, and beside one run after the other.

    python benchmarks/batch_throughput.py [--out docs] [--repeats 101]

writes batch-throughput.json and batch-throughput.png. The runs are the thesis' start-up with a
hold, two balls, no friction, with balls of different masses; rk8, every step recorded. "One by one"
and "side by side" are the compiled loops with their calls, in turns; "whole call" is
`simulate_batch` with its checks of every scene and its trajectories. Errors are against rk8 at
0.25 ms, at every step.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.accuracy.deviation import Deviation, Samples, deviation  # noqa: E402
from ab_sim.batch import simulate_batch  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.dynamics.numbers.lanes import LANES  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402
from ab_sim.studies.effect_cost import Spread, conditions  # noqa: E402

SCENE, CHANGES = "thesis-hold", ["effects.rolling_friction=", "solver.stepper=rk8"]
STEPS = (6e-3, 5e-3, 3.75e-3, 2.5e-3)
REFERENCE_STEP = 2.5e-4
"""s; it divides all steps, so that every one of them is compared."""
VARIATIONS: list[dict[str, Any]] = [{"balls.mass": 1e-3 * (1.0 + 0.01 * i)} for i in range(LANES)]
GOAL, GOAL_RATIO, ERROR = 40_000.0, 5.0, 1e-9


def scene_at(step: float) -> Scene:
    """The scene with this step [s]."""
    return load_scene(SCENE, [*CHANGES, f"solver.step={step}"])


def errors(step: float) -> Deviation:
    """Largest over all runs of the batch."""
    found = []
    runs = simulate_batch(scene_at(step), VARIATIONS).runs
    references = simulate_batch(scene_at(REFERENCE_STEP), VARIATIONS).runs
    for run, reference in zip(runs, references, strict=True):
        ours, truth = Samples.of(run.trajectory), Samples.of(reference.trajectory)
        found.append(deviation(ours, truth, run.scene.whirl_unit[0]))
    return Deviation(*(max(part) for part in zip(*found, strict=True)))


class Alone:
    """The compiled loop of a single run, with its calls: what Drive does but for trajectories."""

    def __init__(self, scene: Scene) -> None:
        self._drive = Drive(scene)
        self._start, self._steps = self._drive.snapshot(), round(scene.duration / scene.solver.step)
        self._samples = np.zeros((self._steps, len(self._drive.channels)))

    def run(self) -> None:
        """From the start to the end."""
        drive = self._drive
        drive._state[:], drive._modes[:] = self._start.state, self._start.modes
        drive._work.smooth[0] = np.nan
        drive._take(drive._way, self._steps, self._samples)


def _seconds(run: Callable[[], Any]) -> float:
    begin = time.thread_time()
    run()
    return time.thread_time() - begin


def compare(step: float, repeats: int) -> dict[str, Any]:
    """Simulated seconds per CPU second, repeat by repeat."""
    scene = scene_at(step)
    alone = Alone(scene)
    found: dict[str, list[float]] = {"one_by_one": [], "side_by_side": [], "whole_call": []}
    simulate_batch(scene, VARIATIONS)
    alone.run()
    for _ in range(repeats):
        found["one_by_one"].append(scene.duration / _seconds(alone.run))
        results: list[Any] = []
        whole = _seconds(lambda into=results: into.append(simulate_batch(scene, VARIATIONS)))
        together = len(VARIATIONS) * scene.duration
        found["side_by_side"].append(together / results[0].integration_seconds)
        found["whole_call"].append(together / whole)
    numbers = {name: np.array(values) for name, values in found.items()}
    ratio = Spread.of(numbers["side_by_side"] / numbers["one_by_one"])
    return {
        "step": step,
        "error": errors(step)._asdict(),
        **{name: Spread.of(values)._asdict() for name, values in numbers.items()},
        "most_side_by_side": float(numbers["side_by_side"].max()),
        "ratio": ratio._asdict(),
    }


def figure(report: dict[str, Any], path: Path) -> None:
    """Bars per step: one by one, side by side, the whole call."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    made, axes = plt.subplots(figsize=(9, 4), constrained_layout=True)
    rows, names = report["rows"], ("one_by_one", "whole_call", "side_by_side")
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
    axes.axvline(GOAL, color="0.3", linestyle=":", label=f"goal: {GOAL:,.0f} at {ERROR:g} rad")
    labels = [
        f"step {1e3 * row['step']:g} ms\n{row['error']['angle']:.0e} rad over the run,\n"
        f"{row['error']['angle_end']:.0e} rad at its end"
        for row in rows
    ]
    axes.set_yticks(range(len(rows)), labels, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("simulated seconds per CPU second, one core")
    axes.margins(x=0.15)
    axes.legend(fontsize=8)
    try:
        made.savefig(path, dpi=120)
    finally:
        plt.close(made)


def main() -> None:
    """Measure and write the two files."""
    asked = arguments("Throughput of runs side by side.", 101).parse_args()
    rows = [compare(step, asked.repeats) for step in STEPS]
    report = {
        **conditions(),
        "scene": SCENE,
        "changes": CHANGES,
        "runs": len(VARIATIONS),
        "repeats": asked.repeats,
        "goal": {"side_by_side": GOAL, "ratio": GOAL_RATIO, "error": ERROR},
        "rows": rows,
    }
    write_json(report, str(asked.out / "batch-throughput.json"))
    figure(report, asked.out / "batch-throughput.png")
    console = Console(markup=False, highlight=False)
    for row in rows:
        console.print(
            f"{1e3 * row['step']:g} ms, {row['error']['angle']:.1e} rad over the run "
            f"({row['error']['angle_end']:.1e} at its end): {row['side_by_side']['median']:,.0f} "
            f"simulated s per CPU s side by side, {row['ratio']['median']:.2f} times one by one "
            f"({row['ratio']['lower']:.2f} to {row['ratio']['upper']:.2f}); whole call "
            f"{row['whole_call']['median']:,.0f}"
        )


if __name__ == "__main__":
    main()

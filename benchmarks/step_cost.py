"""Time per step for 0 to 64 balls, compared with a C kernel of the same scene for 2 and 5.

    python benchmarks/step_cost.py [--out docs] [--repeats 21]

writes step-cost.json and step-cost.png. The scene is the thesis' start-up with a hold, without
friction, at the critical speed. Only the compiled loops are timed, all kernels in turns. Needs gcc
for the C kernel.
"""

import ctypes
import itertools
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from c_kernels import CDrive, build, compiler  # noqa: E402
from first_run import (
    FIRST_STEP,  # noqa: E402
    run_scene,
)
from package_kernel import PackageKernel, ns_per_step  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.effect_cost import Quartiles, conditions  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.engine.kernels.runge_kutta import Tableau  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402

SCENE, CHANGES = "thesis-hold", ["effects.rolling_friction=", "solver.step=0.001"]
BALLS, BESIDE_C = (0, 1, 2, 5, 16, 64), (2, 5)
METHODS = ("rk4", "tsit5", "rk8")
FIRST, STEPS, RUNS = 2600, 300, 4
GOAL, AGREE = 1.3, 1e-11


def kernel(method: str, balls: int) -> PackageKernel:
    """Return the package's kernel with a number of balls of 1 g spread over the race."""
    angles = [2.5 + 0.09 * i for i in range(balls)]
    changes = [f"solver.stepper={method}", f"balls.count={balls}", f"start.ball_angles={angles}"]
    return PackageKernel(load_scene(SCENE, [*CHANGES, *changes]), FIRST, STEPS)


class InC:
    """C kernel that takes the same steps as the package's."""

    def __init__(self, package: PackageKernel) -> None:
        drive, scene = package.drive, package.drive.scene
        tableau = drive.stepper.weights
        assert isinstance(tableau, Tableau)
        deck_model, effects, law = (
            drive.system.deck_model,
            scene.effects,
            package.scheduled.law,
        )
        self._constants = CDrive(
            deck_model.total_mass,
            deck_model.unbalance,
            scene.race.radius,
            effects["suspension"].stiffness,
            effects["suspension"].damping,
            effects["viscous_drag"].coefficient,
            law.start_speed,
            law.acceleration(0.0),
            scene.balls.masses[0],
            scene.balls.radii[0],
        )
        self._package, self._library = package, build(tableau, scene.balls.count)
        self.state = package.start.state.copy()
        self.rows = np.empty((STEPS, self.state.size + 2))

    def run(self) -> None:
        """Take the steps."""
        package = self._package
        self.state[:] = package.start.state
        begin = FIRST * package.drive.step - package.scheduled.start
        self._library.advance(
            ctypes.byref(self._constants),
            begin,
            package.drive.step,
            STEPS,
            self.state.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
            self.rows.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
        )

    def check(self) -> None:
        """Refuse kernels with different results."""
        self._package.run()
        self.run()
        off = float(np.abs(self.state - self._package.state).max())
        if not off < AGREE:
            raise SystemExit(f"C kernel and package differ by {off:.2g}: nothing to compare")


def measure(repeats: int) -> dict[str, Any]:
    """Measure all kernels in turns [ns per step]."""
    kernels = {(method, n): kernel(method, n) for method in METHODS for n in BALLS}
    in_c = {(method, n): InC(kernels[method, n]) for method in METHODS for n in BESIDE_C}
    for one in in_c.values():
        one.check()
    times: dict[Any, list[float]] = {}
    for _ in range(repeats):
        for key, package in kernels.items():
            times.setdefault(key, []).append(ns_per_step(package.run, STEPS, RUNS))
            if key in in_c:
                found = ns_per_step(in_c[key].run, STEPS, RUNS)
                times.setdefault((*key, "c"), []).append(found)
    rows = []
    for method in METHODS:
        for n in BALLS:
            own = np.array(times[method, n])
            row = {"method": method, "balls": n, "ns_per_step": Quartiles.of(own)._asdict()}
            if (method, n) in in_c:
                c = np.array(times[method, n, "c"])
                ratio = Quartiles.of(own / c)
                row |= {
                    "c_ns_per_step": Quartiles.of(c)._asdict(),
                    "ratio_to_c": ratio._asdict(),
                    "within_goal": ratio.median <= GOAL,
                }
            rows.append(row)
    growth = {method: _growth([np.median(times[method, n]) for n in BALLS]) for method in METHODS}
    return {"rows": rows, "ns_per_further_ball": growth, "goal_ratio_to_c": GOAL}


def start_seconds(scene: str, changes: list[str], processes: int = 5) -> dict[str, Any]:
    """Measure the time from a scene to the first step in new processes that compile [s]."""
    with tempfile.TemporaryDirectory() as cache:
        runs = [run_scene(cache, scene, *changes) for _ in range(processes)]
    times = np.array([one[FIRST_STEP] for one in runs])
    return {"scene": scene, "changes": changes, "seconds": Quartiles.of(times)._asdict()}


def _growth(medians: list[Any]) -> dict[str, float]:
    """Return the cost of one more ball between the numbers of balls [ns]; constant if linear."""
    n, t = BALLS[2:], medians[2:]
    return {
        f"{few} to {many}": float((t[i + 1] - t[i]) / (many - few))
        for i, (few, many) in enumerate(itertools.pairwise(n))
    }


def figure(report: dict[str, Any], path: Path) -> None:
    """Draw the time over the number of balls, with the C kernel."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    made, axes = plt.subplots(figsize=(8, 4.5), constrained_layout=True)
    for method, colour in zip(METHODS, ("tab:blue", "tab:green", "tab:red"), strict=True):
        rows = [row for row in report["rows"] if row["method"] == method]
        n = np.array([row["balls"] for row in rows])
        spread = [row["ns_per_step"] for row in rows]
        median = np.array([s["median"] for s in spread])
        whiskers = [median - [s["lower"] for s in spread], [s["upper"] for s in spread] - median]
        last = list(report["ns_per_further_ball"][method].values())[-1]
        axes.errorbar(
            n + 1, median, yerr=whiskers, color=colour, marker="o", capsize=3,
            label=f"{method}: {last:.0f} ns for each ball beyond 16",
        )  # fmt: skip
        beside = [row for row in rows if "c_ns_per_step" in row]
        axes.plot(
            [row["balls"] + 1 for row in beside],
            [row["c_ns_per_step"]["median"] for row in beside],
            "x",
            color=colour,
            markersize=10,
            markeredgewidth=2,
        )
    axes.plot([], [], "kx", label="C, gcc -O3 -march=native, C library's sine")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks([n + 1 for n in BALLS], [str(n) for n in BALLS])
    axes.minorticks_off()
    axes.set_xlabel("balls")
    axes.set_ylabel("time per step [ns]")
    axes.grid(alpha=0.3)
    axes.legend()
    try:
        made.savefig(path, dpi=120)
    finally:
        plt.close(made)


def main() -> None:
    """Measure and write the two files."""
    asked = arguments("Time per step, by the number of balls.", 21).parse_args()
    c_compiler = compiler()
    found = measure(asked.repeats)
    report = {
        **conditions(),
        "c_compiler": c_compiler,
        "scene": SCENE,
        "changes": CHANGES,
        "repeats": asked.repeats,
        "steps_per_repeat": STEPS * RUNS,
        "start": [
            start_seconds(SCENE, [*CHANGES[:1], *more]) for more in ([], ["solver.stepper=imex8"])
        ]
        + [start_seconds(SCENE, more) for more in ([], ["solver.stepper=imex8"])],
        **found,
    }
    write_json(report, str(asked.out / "step-cost.json"))
    figure(report, asked.out / "step-cost.png")
    console = Console(markup=False, highlight=False)
    for row in found["rows"]:
        beside = ""
        if "ratio_to_c" in row:
            ratio = row["ratio_to_c"]
            beside = f", {ratio['median']:.2f} of C ({ratio['lower']:.2f} to {ratio['upper']:.2f})"
        median = row["ns_per_step"]["median"]
        console.print(f"{row['method']}, {row['balls']} balls: {median:.0f} ns{beside}")
    console.print(found["ns_per_further_ball"])


if __name__ == "__main__":
    main()

"""Measure what effects cost, and the package beside a hand-specialised kernel; write it down.

    python benchmarks/effect_cost.py [--out docs] [--repeats 31]

writes effect-cost.json, effect-cost.png and effect-cost.md. The first time takes minutes, to
compile a kernel for each of some twenty sets of effects.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from hand_kernels import ThesisDrive, thesis_advance  # noqa: E402
from package_kernel import PackageKernel, ns_per_step  # noqa: E402

from ab_sim.cli.cost import cost_table, measure_with_progress  # noqa: E402
from ab_sim.figures.effect_cost import cost_figure  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.studies.effect_cost import EffectCost, Spread, conditions  # noqa: E402

SCENES = ("thesis-hold", "everything")
HAND_SCENE, HAND_CHANGES = "thesis-hold", ["effects.rolling_friction="]
FIRST, STEPS, RUNS = 2600, 300, 10
"""The package and the hand kernel take these steps, in the hold at the critical speed."""
GOAL, AGREE = 1.05, 1e-12


class Both:
    """The package's kernel and the hand-specialised one, from the same state on the same arrays."""

    def __init__(self) -> None:
        scene = load_scene(HAND_SCENE, HAND_CHANGES)
        self.package = PackageKernel(scene, FIRST, STEPS)
        carrier, effects = self.package.drive.system.carrier, scene.effects
        self.by_hand = ThesisDrive(
            carrier.total_mass,
            carrier.unbalance,
            scene.race.radius,
            1.0 / scene.race.radius,
            effects["suspension"].stiffness,
            effects["suspension"].damping,
            effects["viscous_drag"].coefficient,
            self.package.piece.segment.start_speed,
            self.package.piece.segment.acceleration(0.0),
        )

    def hand(self) -> None:
        """Take the same steps with the hand-specialised kernel."""
        one = self.package
        one.rewind()
        assert STEPS == thesis_advance(
            self.by_hand,
            one.drive.system,
            one.drive.stepper.weights,
            one.piece.start,
            one.place.angle,
            FIRST,
            one.drive.step,
            one.state,
            one.modes,
            one.work,
            one.samples,
        )

    def disagreement(self) -> float:
        """Largest difference of the samples, relative to each column's largest magnitude."""
        self.package.run()
        package = self.package.samples.copy()
        self.hand()
        size = np.abs(package).max(axis=0)
        off = np.abs(self.package.samples - package) / np.where(size > 0, size, 1.0)
        return float(off.max())

    def compare(self, repeats: int) -> dict[str, Any]:
        """Interleaved times of both [ns per step] and their ratio, repeat by repeat."""
        off = self.disagreement()
        if not off <= AGREE:
            raise SystemExit(f"hand kernel and package differ by {off:.2g}: nothing to compare")
        pair = (self.package.run, self.hand)
        times = np.array([[ns_per_step(run, STEPS, RUNS) for run in pair] for _ in range(repeats)])
        ratio = Spread.of(times[:, 0] / times[:, 1])
        return {
            "scene": HAND_SCENE,
            "changes": HAND_CHANGES,
            "stepper": self.package.drive.stepper.name,
            "steps": STEPS * RUNS,
            "repeats": repeats,
            "disagreement": off,
            "package_ns_per_step": Spread.of(times[:, 0])._asdict(),
            "hand_ns_per_step": Spread.of(times[:, 1])._asdict(),
            "ratio": ratio._asdict(),
            "goal": GOAL,
            "within_goal": ratio.median <= GOAL,
        }


def page(report: dict[str, Any], costs: list[EffectCost]) -> str:
    """effect-cost.md."""
    hand, machine, versions = report["hand"], report["machine"], report["versions"]
    package, by_hand, ratio = hand["package_ns_per_step"], hand["hand_ns_per_step"], hand["ratio"]
    verdict = "met" if hand["within_goal"] else "not met"
    lines = [
        "# What effects cost",
        "",
        "Written by `python benchmarks/effect_cost.py`; do not edit. All numbers are in",
        "[effect-cost.json](effect-cost.json).",
        "",
        "![Time per step of every variant](effect-cost.png)",
        "",
        "Each scene is run without effects, with each effect alone, and with its set, always with",
        "the stepper and step of the scene. An effect that is refused alone comes with what it",
        "needs (`+`). All variants take turns, so that what the machine does besides hits them",
        "alike; a time is the CPU time of the thread in `Drive.advance` per step, over the scene's",
        "run from its start, at most 10,000 steps; bars are medians, whiskers quartiles. Runs",
        "differ in their events (reversals, impacts), each of which costs some ten further steps.",
        "Where a scene starts a ball at exactly 0, all balls start 2.5 rad further: cosines of 0",
        "are quick, and without effects it would stay there.",
        "",
        "## An effect that is not called for costs nothing",
        "",
        f"`{hand['scene']}` without rolling friction, beside a kernel written by hand for just",
        "these effects ([hand_kernels.py](../benchmarks/hand_kernels.py)): same algorithm, same",
        "arrays, fully inlined; the compiled loops alone are timed.",
        "",
        "| ns per step | median | quartiles | least |",
        "| --- | --- | --- | --- |",
        f"| package | {_numbers(package)} |",
        f"| by hand | {_numbers(by_hand)} |",
        f"| ratio | {_numbers(ratio, 3)} |",
        "",
        f"The goal, at most {GOAL}, is {verdict}. Both give the same samples to "
        f"{hand['disagreement']:.1g}.",
        "",
    ]
    for cost in costs:
        lines += [
            f"## {cost.scene}",
            "",
            f"{cost.balls} balls, {cost.stepper} at {cost.step:g} s, {cost.steps_per_run} steps, "
            f"{cost.repeats} repeats.",
            "",
            "| effects | ns per step | quartiles | of base | events per 1000 steps "
            "| first step [s] |",
            "| --- | --- | --- | --- | --- | --- |",
        ]
        for row in cost.rows:
            name = row.name + "".join(f" + {other}" for other in row.added)
            if row.ns_per_step is None or row.ratio is None:
                lines.append(f"| {name} | cannot run: {row.failure} | | | | |")
                continue
            at = row.ns_per_step
            lines.append(
                f"| {name} | {at.median:.0f} | {at.lower:.0f} to {at.upper:.0f} "
                f"| {row.ratio.median:.2f} | {row.events_per_1000_steps:.1f} "
                f"| {row.first_seconds:.2f} |"
            )
        lines.append("")
    load = ", ".join(f"{value:.2f}" for value in machine["load_average"])
    lines += [
        "## Conditions",
        "",
        f"{report['date']}; {machine['processor']}, {machine['cores']} cores, load average {load};",
        f"{machine['system']}; Python {versions['python']}, llvmlite",
        f"{versions['llvmlite']}, NumPy {versions['numpy']}; ab_sim {report['version']}.",
        "",
    ]
    return "\n".join(lines)


def _numbers(spread: dict[str, float], digits: int = 0) -> str:
    median, lower, upper, least = (
        f"{spread[key]:.{digits}f}" for key in ("median", "lower", "upper", "least")
    )
    return f"{median} | {lower} to {upper} | {least}"


def main() -> None:
    """Measure everything and write the three files."""
    parser = arguments("What effects cost.", 31)
    parser.add_argument("--scenes", nargs="*", default=SCENES, help="which to measure")
    asked = parser.parse_args()
    console = Console(markup=False)
    hand = Both().compare(asked.repeats)
    console.print("package / hand:", hand["ratio"])
    costs = [measure_with_progress(load_scene(name), asked.repeats) for name in asked.scenes]
    for cost in costs:
        console.print(cost_table(cost))
    report = {**conditions(), "hand": hand, "scenes": [cost.table() for cost in costs]}
    text = json.dumps(report, indent=1, allow_nan=False) + "\n"
    (asked.out / "effect-cost.json").write_text(text, encoding="utf-8")
    (asked.out / "effect-cost.md").write_text(page(report, costs), encoding="utf-8")
    cost_figure(costs, asked.out / "effect-cost.png")


if __name__ == "__main__":
    main()

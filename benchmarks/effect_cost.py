"""Measure what effects cost; write it down.

    python benchmarks/effect_cost.py [--out docs] [--repeats 31]

writes effect-cost.json, effect-cost.png and effect-cost.md.
"""

import json
import sys
from pathlib import Path
from typing import Any

from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402

from ab_sim.cli.costs import cost_table  # noqa: E402
from ab_sim.cli.progress import progress_bar  # noqa: E402
from ab_sim.figures.effect_cost import cost_figure  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.studies.effect_cost import EffectCost, conditions, measure  # noqa: E402

SCENES = ("thesis-hold", "everything")


def page(report: dict[str, Any], costs: list[EffectCost]) -> str:
    """effect-cost.md."""
    machine, versions = report["machine"], report["versions"]
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
        "differ in their events (reversals, impacts), each of which takes 3 to 5 more steps.",
        "Where a scene starts a ball at exactly 0, all balls start 2.5 rad further: cosines of 0",
        "are quick, and without effects it would stay there.",
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


def main() -> None:
    """Measure everything and write the three files."""
    parser = arguments("What effects cost.", 31)
    parser.add_argument("--scenes", nargs="*", default=SCENES, help="which to measure")
    asked = parser.parse_args()
    console = Console(markup=False)
    costs = []
    for name in asked.scenes:
        with progress_bar(name) as tell:
            costs.append(measure(load_scene(name), asked.repeats, progress=tell))
    for cost in costs:
        console.print(cost_table(cost))
    report = {**conditions(), "scenes": [cost.table() for cost in costs]}
    text = json.dumps(report, indent=1, allow_nan=False) + "\n"
    (asked.out / "effect-cost.json").write_text(text, encoding="utf-8")
    (asked.out / "effect-cost.md").write_text(page(report, costs), encoding="utf-8")
    cost_figure(costs, asked.out / "effect-cost.png")


if __name__ == "__main__":
    main()

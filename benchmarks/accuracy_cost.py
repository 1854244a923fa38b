"""Measure the cost of an accuracy in the thesis' start-up with a hold, without friction.

    python benchmarks/accuracy_cost.py [--out docs] [--repeats 9]

writes accuracy-cost.json and accuracy-cost.png; it takes some minutes. Needs the extra `peers`.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.accuracy_cost import REPEATS, accuracy_cost  # noqa: E402
from ab_sim.cli.costs import accuracy_shown  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.cli.progress import progress_bar  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.show.costs import drawn_accuracy  # noqa: E402
from ab_sim.show.saved import save  # noqa: E402

SCENE, CHANGES = "thesis-hold", ["effects.rolling_friction="]


def main() -> None:
    """Measure and write the two files."""
    asked = arguments("What an accuracy costs.", REPEATS).parse_args()
    scene = load_scene(SCENE, CHANGES)
    with progress_bar(scene.name) as tell:
        cost = accuracy_cost(scene, asked.repeats, progress=tell)
    report = {"changes": CHANGES, **cost.report()}
    write_json(report, str(asked.out / "accuracy-cost.json"))
    save(drawn_accuracy(cost), asked.out / "accuracy-cost.png", 120)
    console = Console(markup=False)
    for each in accuracy_shown(cost):
        console.print(each)


if __name__ == "__main__":
    main()

"""Check that `identify` names exactly the parameters that recordings do not determine.

    python benchmarks/identification_knowledge.py [--out docs] [--drives 20] [--only TEXT]

writes identification-knowledge.json, and its part of identification.md. For each case of recordings
and fitted parameters, theory predicts the unidentifiable directions
(tests/identification/knowledge_cases.py). On random drives, recorded with 1 % noise, `identify` is
evaluated as in its own procedure: before the fit, from a scene that is up to 35 % off, and after
it, here at the true values.
"""

import json
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from identification_drives import blind_drive  # noqa: E402
from identification_page import write_page  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from tests.identification.knowledge_cases import CASES, Case, opened_in, problem_of  # noqa: E402


def told_of(case: Case, seed: int) -> dict[str, Any]:
    """Return the directions reported for a random drive, and which of them are right."""
    blind = blind_drive(seed, False)
    opened = opened_in(*problem_of(case, blind.scene, blind.guess, seed), seed)
    named = {name for each in opened for name, _ in each.parts}
    unknown = {name for direction in case.unknown for name in direction}
    return {
        "seed": seed,
        "directions": len(opened),
        "not_named": sorted(unknown - named),
        "wrongly": sorted(named - unknown),
        "words": [each.words for each in opened],
        "held": [each.held for each in opened],
    }


def of_case(case: Case, seeds: range) -> dict[str, Any]:
    """Return the results of all drives of a case."""
    drives = [told_of(case, seed) for seed in seeds]
    return {
        "case": case.name,
        "fit": list(case.fit),
        "unknown": [sorted(direction) for direction in case.unknown],
        "drives": drives,
        "right": sum(
            not (each["not_named"] or each["wrongly"])
            and each["directions"] == len(case.unknown)
            for each in drives
        ),
    }  # fmt: skip


def main() -> None:
    """Run all cases, and write JSON and page."""
    parser = arguments(__doc__.splitlines()[0], 1)
    parser.add_argument("--drives", type=int, default=20, help="of each case")
    parser.add_argument("--seed", type=int, default=0, help="of the first drive")
    parser.add_argument("--only", default="", help="cases with this in their names; others stay")
    told = parser.parse_args()
    file = told.out / "identification-knowledge.json"
    before = json.loads(file.read_text())["cases"] if told.only else []
    cases = {each["case"]: each for each in before}
    for case in CASES:
        if told.only in case.name:
            cases[case.name] = of_case(case, range(told.seed, told.seed + told.drives))
            Console().print(case.name, cases[case.name]["right"], "of", told.drives)
    report = {
        "conditions": conditions(),
        "cases": [cases[each.name] for each in CASES if each.name in cases],
    }
    write_json(report, str(file))
    write_page(told.out)


if __name__ == "__main__":
    main()

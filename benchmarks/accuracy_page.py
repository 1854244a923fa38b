"""Write docs/accuracy.md from the reports of the benchmarks.

    python benchmarks/accuracy_page.py [--docs docs]

Run accuracy_cost.py, peers.py with and without --avx2, step_cost.py and many_runs.py first.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from beside.page import peers_part  # noqa: E402
from page_parts import conditions, error, folded, sentence, table  # noqa: E402

from ab_sim.drive.accuracy import SAFETY  # noqa: E402

DOCS = Path(__file__).resolve().parents[1] / "docs"
SHOWN_STEPS = (0.005, 0.0025, 0.001, 0.0005)
"""Steps that the page shows [s]."""

TEXT = """\
# What an accuracy costs

Written by `python benchmarks/accuracy_page.py` from the JSON files named below; do not edit.

## Choose an accuracy

A stepper (integrator) computes a run in short steps and makes a small error in each. Halving the
step divides the error by 2^4 = 16 for a stepper of order 4 and by 2^8 = 256 for one of order 8.
Which stepper is cheapest depends on the error that you accept.

State the largest error in the scene instead of a solver:

    accuracy: {{angle: 1.0e-6}}        # rad; or whirl: 1.0e-3, in units of e; or both

ab_sim then measures, on this scene, which setting delivers it at the lowest cost, with a safety
factor of {safety:g}. `ab-sim check`, `ab-sim run` and the node report the setting and its cost. An
error below the limit of double precision is refused, and the message names the best value. The
measurement compares with a shorter step of ab_sim's own steppers. It therefore covers the error of
the integration, not mistakes in the equations. For those, the tests use [an independent
simulator](../tests/reference).

| purpose | error in a ball's angle [rad] |
| --- | --- |
| place a ball on the race | 1e-3 |
| compare two designs | 1e-6 |
| compare two programs | 1e-10 |

The whirl may need more: its error, in units of the eccentricity e, is {whirl_least:.0f} to
{whirl_most:.0f} times the error of the angle in rad, depending on stepper and step. If the whirl
matters, request `whirl`.

## Error and CPU time

![Error against CPU time, for every stepper and for other integrators](accuracy-cost.png)

Each line is one method, each point one setting; down and left is better. The vertical line is real
time on one core. The grey band is the uncertainty of the reference. Solid lines are ab_sim's
steppers, dashed lines are other integrators with the same equations. Errors are the largest of the
whole run, sampled at least every {reference_period:g} ms (other integrators: {period:g} ms).

{accuracy_title}. {accuracy_cheapest}

{accuracy_table}

The reference is {reference}. Its uncertainty is {uncertainty_angle:.1e} rad and
{uncertainty_whirl:.1e} e. Scenes with friction, contact or a motor have no independent reference:
`ab-sim accuracy` then compares with `rk8` and `tsit5` at short steps, and says so. To draw this
picture for your scene:

    ab-sim accuracy my-scene.yaml --plot accuracy.png --json accuracy.json

Measured by `python benchmarks/accuracy_cost.py` ([accuracy-cost.json](accuracy-cost.json));
{accuracy_conditions}.

## Other programs at the same error

![Error against CPU time, ab_sim and the fastest other programs](peers.png)

CPU time [us per simulated second] at an error in a ball's angle over the whole run, with output
every {peers_period:g} ms; medians, interpolated between two settings. Compiling is not included.
The AVX2 columns limit all code to AVX2 vectors.

{peers_verdict}

{peers_table}

Eight runs at once, in simulated seconds per CPU second. {peers_batch_verdict}

{peers_batch_table}

CPU time of the best other program divided by ours, with one thing changed:

{peers_cases}

All programs solve the same equations; how each was called is in the JSON files.

The reference is {peers_reference}. Its uncertainty is {peers_known}.

Measured by `python benchmarks/peers.py` and with `--avx2` ([peers.json](peers.json),
[peers-avx2.json](peers-avx2.json)); {peers_conditions}.

## Time per step

![Time per step over the number of balls](step-cost.png)

CPU time per step [ns] for decks with n balls; in brackets, the time divided by that of the same
scene written by hand in C ([thesis.c](../benchmarks/c_kernel/thesis.c)):

{step_table}

Time to the first step of a new process, which generates the machine code: {start}.

Measured by `python benchmarks/step_cost.py` ([step-cost.json](step-cost.json)); {step_conditions}.

## Many runs at once

CPU time per run [us] of {many_runs:,} runs of 6 s in two threads, from ball masses to
`{many_metric}`. Settings are the coarsest with an error. Compiling is not included.

{many_table}

{many_verdict}

Measured by `python benchmarks/many_runs.py` ([many-runs.json](many-runs.json)); {many_conditions}.
"""


def accuracy_part(report: dict[str, Any]) -> dict[str, Any]:
    """Return the work-precision study."""
    rows, ratios = [], []
    for row in sorted(
        (row for row in report["rows"] if row["errors"]), key=lambda row: row["cpu"]["median"]
    ):
        errors = row["errors"]
        if not row["peer"] and not errors["angle"]["at_most"]:
            ratios.append(errors["whirl"]["value"] / errors["angle"]["value"])
        if row["peer"] or row["step"] not in SHOWN_STEPS:
            continue
        rows.append([
            row["method"],
            f"{1e3 * row['step']:g} ms",
            error(errors["angle"]),
            error(errors["whirl"]),
            f"{1e3 * row['cpu']['median']:.3g}",
        ])  # fmt: skip
    head = ["stepper", "step", "angle [rad]", "whirl [e]", "CPU ms per simulated s"]
    return {
        "accuracy_title": f"`{report['scene']}` without rolling friction",
        "accuracy_cheapest": cheapest(report),
        "accuracy_table": folded(f"All {len(rows)} settings, cheapest first", table(head, rows)),
        "period": 1e3 * report["period"],
        "reference_period": 1e3 * report["reference_period"],
        "whirl_least": min(ratios),
        "whirl_most": max(ratios),
        "reference": report["reference"],
        "uncertainty_angle": report["uncertainty"]["angle"],
        "uncertainty_whirl": report["uncertainty"]["whirl"],
        "accuracy_conditions": conditions(report),
    }


def cheapest(report: dict[str, Any]) -> str:
    """Return a sentence with the cheapest setting at some errors."""
    ours = [row for row in report["rows"] if row["errors"] and not row["peer"]]
    limits: dict[str, list[str]] = {}
    for limit in (1e-3, 1e-6, 1e-9):
        fit = [row for row in ours if row["errors"]["angle"]["value"] <= limit]
        row = min(fit, key=lambda row: row["cpu"]["median"])
        setting = (
            f"{row['method']} with {1e3 * row['step']:g} ms "
            f"({1e3 * row['cpu']['median']:.3g} CPU ms per simulated second)"
        )
        limits.setdefault(setting, []).append(f"{limit:g} rad")
    texts = [f"below {', '.join(errors)}: {setting}" for setting, errors in limits.items()]
    return f"Cheapest {'; '.join(texts)}."


def step_part(report: dict[str, Any]) -> dict[str, Any]:
    """Return the time per step."""
    counts = sorted({row["balls"] for row in report["rows"]})
    times: dict[str, dict[int, str]] = {}
    for row in report["rows"]:
        ratio = f" ({row['ratio_to_c']['median']:.2f})" if "ratio_to_c" in row else ""
        times.setdefault(row["method"], {})[row["balls"]] = (
            f"{row['ns_per_step']['median']:,.0f}{ratio}"
        )
    rows = [[method, *(by.get(count, "") for count in counts)] for method, by in times.items()]
    start = "; ".join(
        f"`{' '.join([one['scene'], *(f'--set {change}' for change in one['changes'])])}`: "
        f"{one['seconds']['median']:.2f} s"
        for one in report["start"]
    )
    return {
        "step_table": table(["method", *(f"n = {count}" for count in counts)], rows),
        "start": start,
        "step_conditions": conditions(report),
    }


def many_part(report: dict[str, Any]) -> dict[str, Any]:
    """Return the comparison of many runs."""
    times: dict[str, list[str]] = {}
    for row in report["rows"]:
        for one in sorted(row["methods"], key=lambda x: x["seconds_per_run"]["median"]):
            text = f"{1e6 * one['seconds_per_run']['median']:.0f} ({one['setting']})"
            times.setdefault(one["method"], []).append(text)
    head = ["method", *(f"{row['error']:g} rad" for row in report["rows"])]
    verdicts = [
        f"at {row['error']:g} rad {row['peer']} takes {row['ratio']['median']:.2f} times as long "
        f"as `{row['ours']}`"
        for row in report["rows"]
    ]
    return {
        "many_runs": report["runs"],
        "many_metric": report["metric"],
        "many_table": table(head, [[name, *cells] for name, cells in times.items()]),
        "many_verdict": sentence(verdicts),
        "many_conditions": conditions(report),
    }


def main() -> None:
    """Read the reports and write the page."""
    parser = argparse.ArgumentParser(description="Write the page on accuracy.")
    parser.add_argument("--docs", type=Path, default=DOCS)
    docs = parser.parse_args().docs
    names = "accuracy-cost", "peers", "peers-avx2", "step-cost", "many-runs"
    accuracy, peers, limited, steps, many = (
        json.loads((docs / f"{name}.json").read_text(encoding="utf-8")) for name in names
    )
    filled = {
        "safety": SAFETY,
        **accuracy_part(accuracy),
        **peers_part(peers, limited),
        **step_part(steps),
        **many_part(many),
    }
    (docs / "accuracy.md").write_text(TEXT.format(**filled), encoding="utf-8")


if __name__ == "__main__":
    main()

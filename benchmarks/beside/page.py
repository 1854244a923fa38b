"""The part of docs/accuracy.md that tells of peers.json."""

from typing import Any

from page_parts import conditions, left_out_list, sentence, spread, table

from beside.heyoka_peer import NAME
from beside.turns import VERDICT, verdict


def peers_part(report: dict[str, Any]) -> dict[str, Any]:
    """Beside the peers."""
    rows, many = [], []
    for result in report["at"]:
        for row in result["rows"]:
            ratio = spread(row["ratio"]) if "ratio" in row else ""
            rows.append([*_what(result, row), spread(row["cpu"], 1e6), ratio])
    for result in report["batch"]["at"]:
        for row in result["rows"]:
            cpu = row["cpu"]
            ends = {"lower": "upper", "median": "median", "upper": "lower"}
            rate = {end: 1.0 / cpu[other] for end, other in ends.items()}
            many.append([*_what(result, row), spread(rate)])
    others = []
    for case in report["cases"]:
        for result in case["at"]:
            if result["error"] < case["uncertainty"]["angle"]:
                continue
            cpu = {row["method"]: spread(row["cpu"], 1e6) for row in result["rows"]}
            ours, peer, ratio = result["ours"], result["best_peer"], result["ratio"]
            others.append([
                case["case"], f"{result['error']:g} rad",
                *(f"{who}: {cpu[who]}" if who else "none" for who in (ours, peer)),
                spread(ratio) if ratio else "", VERDICT[result["met"]],
            ])  # fmt: skip
    goals = {result["goal"] for case in report["cases"] for result in case["at"]}
    head = ["error in ball angle", "method", "setting"]
    return {
        "peers_period": 1e3 * report["period"],
        "peers_reference": report["reference"],
        "peers_known": ", ".join(
            f"{one['uncertainty']['angle']:.0e} rad ({name})"
            for name, one in [
                ("the drive itself", report),
                *((case["case"], case) for case in report["cases"]),
            ]
        ),
        "called": "\n".join(f"- {who}: {how}." for who, how in report["called"].items()),
        "first_runs": _first_runs([*report["rows"], *report["batch"]["rows"]]),
        "peers_table": table([*head, "CPU us per simulated s", "times ours"], rows),
        "peers_verdict": sentence([verdict(result) for result in report["at"]]),
        "loop_verdict": "Beside our compiled loop alone: "
        + "; ".join(verdict(result) for result in report["loop_at"])
        + ".",
        "peers_batch_table": table([*head, "simulated s per CPU s"], many),
        "peers_batch_verdict": sentence([verdict(result) for result in report["batch"]["at"]]),
        "peers_cases": table(
            [
                "case",
                "error",
                "ours",
                "best peer",
                "times ours",
                f"goal: {', '.join(f'{goal:g}' for goal in goals)}",
            ],
            others,
        ),  # fmt: skip
        "peers_left_out": left_out_list(report["left_out"]),
        "peers_conditions": conditions(report),
    }


def _what(result: dict[str, Any], row: dict[str, Any]) -> list[str]:
    return [f"{result['error']:g} rad", row["method"], " to ".join(row["between"])]


def _first_runs(rows: list[dict[str, Any]]) -> str:
    """Of what compiles its own equations anew, from the quickest setting to the slowest."""
    found: dict[str, list[float]] = {}
    for row in rows:
        if row["method"].startswith(NAME):
            found.setdefault(row["method"], []).append(row["first"])
    times = (f"{what}: {min(s):.2g} to {max(s):.2g} s" for what, s in found.items())
    return "; ".join(times) or f"not known without {NAME}"

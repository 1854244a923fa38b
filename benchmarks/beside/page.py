"""The part of docs/accuracy.md that tells of peers.json."""

from typing import Any

from page_parts import conditions, left_out_list, sentence, spread, table

from beside.heyoka_peer import NAME
from beside.turns import VERDICT, verdict

HEAD = ["error in ball angle", "method", "setting"]
MOST = 8
"""Methods at an error where not all are shown."""


def peers_part(report: dict[str, Any]) -> dict[str, Any]:
    """Beside the peers."""
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
    rows, many = _rows(report["at"]), _rates(report["batch"]["at"])
    goals = {result["goal"] for case in report["cases"] for result in case["at"]}
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
        "peers_table": table([*HEAD, "CPU us per simulated s", "times ours"], rows),
        "peers_verdict": sentence([verdict(result) for result in report["at"]]),
        "loop_verdict": "Beside our compiled loop alone: "
        + "; ".join(verdict(result) for result in report["loop_at"])
        + ".",
        "peers_batch_table": table([*HEAD, "simulated s per CPU s"], many),
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


def limited_part(report: dict[str, Any]) -> dict[str, Any]:
    """The same where vectors are limited: the quickest only."""
    one, many = (_but_few(results) for results in (report["at"], report["batch"]["at"]))
    return {
        "limited_vectors": report["vectors"],
        "limited_most": MOST,
        "limited_table": table([*HEAD, "CPU us per simulated s", "times ours"], _rows(one)),
        "limited_verdict": sentence([verdict(result) for result in report["at"]]),
        "limited_batch_table": table([*HEAD, "simulated s per CPU s"], _rates(many)),
        "limited_batch_verdict": sentence(
            [verdict(result) for result in report["batch"]["at"]],
        ),
        "limited_left_out": left_out_list(report["left_out"]),
        "limited_conditions": conditions(report),
    }


def _but_few(results: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{**result, "rows": result["rows"][:MOST]} for result in results]


def _rows(results: list[dict[str, Any]]) -> list[list[str]]:
    """Times of single runs."""
    return [
        [
            *_what(result, row),
            spread(row["cpu"], 1e6),
            spread(row["ratio"]) if "ratio" in row else "",
        ]
        for result in results
        for row in result["rows"]
    ]


def _rates(results: list[dict[str, Any]]) -> list[list[str]]:
    """Simulated seconds per CPU second of batches."""
    rows, ends = [], {"lower": "upper", "median": "median", "upper": "lower"}
    for result in results:
        for row in result["rows"]:
            rate = {end: 1.0 / row["cpu"][other] for end, other in ends.items()}
            rows.append([*_what(result, row), spread(rate)])
    return rows


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

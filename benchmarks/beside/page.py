"""Part of docs/accuracy.md on peers.json and peers-avx2.json."""

from typing import Any

from page_parts import conditions, folded, sentence, table

HIDDEN = ", compiled loop"
"""End of the name of a method that users do not call."""


def peers_part(report: dict[str, Any], limited: dict[str, Any]) -> dict[str, Any]:
    """Return the comparison with other programs.

    Parameters
    ----------
    report
        peers.json.
    limited
        Peers-avx2.json, the same with all code limited to AVX2.
    """
    errors = [f"{result['error']:g}" for result in report["at"]]
    cases = []
    for case in report["cases"]:
        cells = []
        for result in case["at"]:
            judged = result["error"] >= case["uncertainty"]["angle"] and result["ratio"]
            cells.append(
                f"{result['ratio']['median']:.3g} ({result['best_peer']})" if judged else ""
            )
        cases.append([case["case"], *cells])
    head = ["method", *(f"{one} rad" for one in errors), *(f"AVX2: {one}" for one in errors)]
    known = [("the drive itself", report), *((case["case"], case) for case in report["cases"])]
    return {
        "peers_period": 1e3 * report["period"],
        "peers_reference": report["reference"],
        "peers_known": ", ".join(
            f"{one['uncertainty']['angle']:.0e} rad ({name})" for name, one in known
        ),
        "peers_table": folded("All methods", table(head, _rows(report["at"], limited["at"]))),
        "peers_verdict": _verdict(report["at"]),
        "peers_batch_table": folded(
            "All methods", table(head, _rows(report["batch"]["at"], limited["batch"]["at"], True))
        ),
        "peers_batch_verdict": _verdict(report["batch"]["at"]),
        "peers_cases": table(["case", *(f"{one} rad" for one in errors)], cases),
        "peers_conditions": conditions(report),
    }


def _rows(
    results: list[dict[str, Any]], limited: list[dict[str, Any]], rate: bool = False
) -> list[list[str]]:
    """Return one row per method: medians at each error, then those with AVX2.

    Parameters
    ----------
    results
        One entry per error.
    limited
        The same with AVX2.
    rate
        Simulated seconds per CPU second in place of microseconds per simulated second.
    """
    columns = [
        {row["method"]: row["cpu"]["median"] for row in result["rows"]}
        for result in (*results, *limited)
    ]
    methods = sorted(
        {method for column in columns for method in column if not method.endswith(HIDDEN)},
        key=lambda method: columns[0].get(method, float("inf")),
    )
    return [
        [method, *(_text(column.get(method), rate) for column in columns)] for method in methods
    ]


def _text(seconds: float | None, rate: bool) -> str:
    if seconds is None:
        return ""
    value = 1.0 / seconds if rate else 1e6 * seconds
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def _verdict(results: list[dict[str, Any]]) -> str:
    """Return the best other program's time over ours, as a sentence."""
    return sentence([
        f"at {result['error']:g} rad {result['best_peer']} takes {result['ratio']['median']:.2f} "
        f"times as long as `{result['ours'].partition(',')[0]}`"
        for result in results
        if result["ours"] and result["best_peer"]
    ])  # fmt: skip

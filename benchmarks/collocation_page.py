"""The part of docs/accuracy.md that tells of collocation.json and collocation-at-random.json."""

from typing import Any

from page_parts import conditions, table

GOALS = {
    **dict.fromkeys(("hardening", "gravity", "unequal", "runout", "motor"), 1.0),
    **dict.fromkeys(("feeding-deck", "feeding-deck on edge", "couple-unbalance"), 2.0),
    "as shipped": 2.0,
}
"""How many times as long rk8 has to take at least, at no larger error."""


def collocation_part(report: dict[str, Any], random: dict[str, Any]) -> dict[str, Any]:
    """Beside rk8, case by case."""
    rows = []
    for case in dict.fromkeys(row["case"] for row in report["rows"]):
        here = [row for row in report["rows"] if row["case"] == case]
        own = [row for row in here if row["stepper"] == "collocation"]
        for row in here:
            enough = [one for one in own if one["error"] <= max(row["error"], _known_to(row))]
            if row["stepper"] != "collocation":
                rows.append(_beside(row, min(enough, key=_took, default=None), own))
    live = [
        [row["case"], row["stepper"], *(f"{row[q]:.1f}" for q in ("p50", "p99", "p99.9"))]
        for row in report["live"]
    ]
    off = [row["error_over_tolerance"] / max(row["grown"], 1.0) for row in random["rows"]]
    least = min(row["rk8_takes_times"] for row in random["rows"] if row["rk8_takes_times"])
    price = ["error [rad]", "us per simulated s"]
    head = ["case", "rk8 at", *price, "collocation, samples every", "tolerance", *price]
    head += ["rk8 takes times", "goal"]
    return {
        "collocation_table": table(head, rows),
        "collocation_live": table(["case", "stepper", "p50 [us]", "p99", "p99.9"], live),
        "random_count": len({(row["plant"], row["seed"]) for row in random["rows"]}),
        "random_off": max(off),
        "random_least": least,
        "collocation_conditions": conditions(report),
        "random_conditions": conditions(random),
    }


def _took(row: dict[str, Any]) -> float:
    return float(row["run_us"]["median"])


def _known_to(row: dict[str, Any]) -> float:
    return float(row["reference_error"])


def _beside(
    row: dict[str, Any], own: dict[str, Any] | None, tried: list[dict[str, Any]]
) -> list[str]:
    known = [row["case"], f"{1e3 * row['step']:g} ms", _error(row), f"{_took(row):.0f}"]
    if own is None:
        least = min(tried, key=lambda one: float(one["error"]))
        return [*known, "none errs as little", f"{least['tolerance']:g}", _error(least), *3 * [""]]
    ratio, goal = _took(row) / _took(own), GOALS.get(row["case"])
    met = "" if goal is None else f"{goal:g}, " + ("met" if ratio >= goal else "**not met**")
    return [
        *known,
        f"{1e3 * own['step']:g} ms",
        f"{own['tolerance']:g}",
        _error(own),
        f"{_took(own):.0f}",
        f"{ratio:.3g}",
        met,
    ]


def _error(row: dict[str, Any]) -> str:
    return (
        f"{row['error']:.1e}" if row["error"] > _known_to(row) else f"at most {_known_to(row):.0e}"
    )

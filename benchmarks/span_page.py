"""The part of docs/accuracy.md that tells of span-cost.json."""

import math
from typing import Any

from page_parts import conditions, table


def span_part(report: dict[str, Any], batches: dict[str, Any]) -> dict[str, Any]:
    """Where collocation's time goes, and a batch's.

    Args:
        report: what span_cost.py has measured.
        batches: what batch_throughput.py has.
    """
    duration, each = report["duration"], report["each_ns"]
    rest = each["what all runs have alike"] / duration
    chosen = [row for row in report["rows"] if row["steps"] == 0]
    rows = []
    for row in chosen:
        whole = sum(row["parts"].values())
        rows.append([
            f"{row['tolerance']:g} rad",
            f"{1e3 * duration / row['spans']:.1f} ms",
            f"{row['spans'] / duration:.0f}",
            f"{row['iterations'] / row['spans']:.2f}",
            f"{row['ns']['median'] / duration / 1e3:.1f}",
            *(f"{row['parts'][name] / whole:.0%}" for name in each),
        ])  # fmt: skip
    head = ["tolerance", "mean length of a span", "spans per s", "iterations in each",
            "us per simulated s", *(f"of it {name}" for name in each)]  # fmt: skip
    many = [
        [f"{one['tolerance']:g} rad"]
        + [f"{one[key] / 1e3:.0f}" for key in one if key != "tolerance"]
        for one in report["batch"]
    ]
    parts = [key for key in report["batch"][0] if key != "tolerance"]
    return {
        "span_table": table(head, rows),
        "span_each": (
            f"{each['spans']:.0f} ns for a span with the samples in it, {each['iterations']:.0f} "
            f"for each of its iterations, and {rest / 1e3:.1f} us per simulated s for what all "
            "runs have alike; no run's time is further from that than "
            f"{max(abs(row['fit_is_off']) for row in report['rows']):.0%}"
        ),
        "span_heyoka": _heyoka(report, chosen),
        "span_reason": _reason(report, chosen),
        "span_batch": table(["tolerance", *parts], many),
        "span_lanes": "; ".join(_lanes(row) for row in batches["rows"] if row["stepper"] == "rk8"),
        "span_conditions": conditions(report),
    }


def _heyoka(report: dict[str, Any], chosen: list[dict[str, Any]]) -> str:
    if not report["heyoka"]:
        return "(heyoka.py was not there.)"
    rows = [
        [
            f"{one['tolerance']:g}",
            f"{row['tolerance']:g} rad",
            str(one["order"]),
            f"{1e3 * report['duration'] / one['steps']:.1f} ms",
            f"{one['steps'] / report['duration']:.0f}",
            f"{one['ns']['median'] / one['steps']:.0f}",
            f"{one['ns']['median'] / report['duration'] / 1e3:.1f}",
        ]
        for one, row in zip(report["heyoka"], chosen, strict=True)
    ]
    head = ["heyoka's tolerance", "beside ours", "order", "mean length of a step", "steps per s",
            "ns for a step", "us per simulated s"]  # fmt: skip
    return table(head, rows)


def _reason(report: dict[str, Any], chosen: list[dict[str, Any]]) -> str:
    loose, tight = chosen[0], chosen[-1]
    shorter = tight["spans"] / loose["spans"]
    power = math.log(loose["tolerance"] / tight["tolerance"]) / math.log(shorter)
    said = (
        f"From {loose['tolerance']:g} to {tight['tolerance']:g} rad our spans get {shorter:.1f} "
        f"times as many: eight nodes, and a tolerance that goes with the {power:.1f}th power of "
        "their length"
    )
    if not report["heyoka"]:
        return said
    first, last = report["heyoka"][0], report["heyoka"][-1]
    dearer = (last["ns"]["median"] / last["steps"]) / (first["ns"]["median"] / first["steps"])
    return (
        f"{said}. heyoka's series goes from order {first['order']} to {last['order']}: "
        f"{last['steps'] / first['steps']:.2f} times as many steps, each of which takes "
        f"{dearer:.2f} times as long"
    )


def _lanes(row: dict[str, Any]) -> str:
    step = 8e9 * row["step"] / row["kernel"]["median"]
    return f"{step:.0f} ns at {1e3 * row['step']:g} ms"

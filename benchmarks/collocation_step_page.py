"""The part of docs/accuracy.md that tells of span-cost.json."""

from typing import Any

from page_parts import conditions, table


def collocation_step_part(report: dict[str, Any]) -> dict[str, Any]:
    """Where collocation's time goes, and a batch's."""
    duration, each = report["duration"], report["each_ns"]
    names = list(next(iter(each.values())))
    chosen = [row for row in report["rows"] if row["steps"] == 0]
    rows = []
    for row in chosen:
        took = row["ns"]["median"]
        rows.append([
            f"{row['tolerance']:g} rad",
            str(row["nodes"]),
            f"{row['error']:.1e}",
            f"{row['spans'] / duration:.0f}",
            f"{row['refused'] / duration:.1f}",
            f"{row['iterations'] / row['spans']:.2f}",
            f"{took / duration / 1e3:.1f}",
            *(f"{row['parts'][name] / took:.0%}" for name in names),
            f"{1.0 - sum(row['parts'].values()) / took:.0%}",
        ])  # fmt: skip
    head = ["tolerance", "nodes", "error over the run [rad]", "spans per s", "of them refused",
            "iterations in each", "us per simulated s", *(f"of it {name}" for name in names),
            "not explained"]  # fmt: skip
    parts = [key for key in report["batch"][0] if key != "tolerance"]
    many = [
        [f"{one['tolerance']:g} rad", *(f"{one[key] / 1e3:.0f}" for key in parts)]
        for one in report["batch"]
    ]
    return {
        "span_table": table(head, rows),
        "span_each": (
            "; ".join(
                f"with {count} nodes {ns['spans']:.0f} ns for a span with the samples in it, "
                f"{ns['iterations']:.0f} for each of its iterations, and "
                f"{ns['what all runs have alike'] / duration / 1e3:.1f} us per simulated s for "
                "what all runs have alike"
                for count, ns in each.items()
            )
            + "; the run that is furthest from that takes "
            f"{max(abs(row['fit_is_off']) for row in report['rows']):.1%} more or less"
        ),
        "span_heyoka": _heyoka(report),
        "span_reason": _reason(report, chosen),
        "span_seconds": duration,
        "span_batch": table(["tolerance", *parts], many),
        "span_conditions": conditions(report),
    }


def _heyoka(report: dict[str, Any]) -> str:
    if not report["heyoka"]:
        return "(heyoka.py was not there.)"
    rows = [
        [
            f"{one['beside']:g} rad",
            f"{one['tolerance']:g}",
            f"{one['error']:.1e}",
            str(one["order"]),
            f"{one['steps'] / report['duration']:.0f}",
            f"{one['ns']['median'] / one['steps']:.0f}",
            f"{one['ns']['median'] / report['duration'] / 1e3:.1f}",
        ]
        for one in report["heyoka"]
    ]
    head = ["beside our tolerance", "heyoka's", "its error over the run [rad]", "order",
            "steps per s", "ns for a step with its outputs", "us per simulated s"]  # fmt: skip
    return table(head, rows)


def _reason(report: dict[str, Any], chosen: list[dict[str, Any]]) -> str:
    loose, tight = chosen[0], chosen[-1]
    said = (
        f"From {loose['tolerance']:g} rad with {loose['nodes']} nodes to {tight['tolerance']:g} "
        f"with {tight['nodes']} we take {tight['spans'] / loose['spans']:.2f} times as many spans, "
        "of the lengths that they may have"
    )
    if len(report["heyoka"]) < len(chosen):
        return f"{said}."
    first, last = report["heyoka"][0], report["heyoka"][-1]
    dearer = (last["ns"]["median"] / last["steps"]) / (first["ns"]["median"] / first["steps"])
    ours = tight["ns"]["median"] / loose["ns"]["median"]
    theirs = last["ns"]["median"] / first["ns"]["median"]
    return (
        f"{said}. heyoka's series goes from order {first['order']} to {last['order']}: "
        f"{last['steps'] / first['steps']:.2f} times as many steps, each of which takes "
        f"{dearer:.2f} times as long. So the smaller error costs us {ours:.2f} times the time, and "
        f"heyoka {theirs:.2f} times."
    )

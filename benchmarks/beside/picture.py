"""Picture of error against time of every method, and of the batches."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

COLOURS = {"imex8": "tab:red", "rk8": "tab:orange", "taylor": "tab:pink",
           "heyoka": "tab:blue", "Taylor in C++": "black", "RK8 in C++": "dimgray",
           "CVODE Adams": "tab:green", "CVODE BDF": "tab:olive", "ARKODE": "tab:cyan",
           "LSODA": "tab:purple", "DOP853": "tab:brown", "MuJoCo": "tab:gray"}  # fmt: skip
LINES = ("-", "--", ":", "-.")
LEAST, MOST = 1e-14, 1e-3
"""Limits of the error axis [rad]; smaller errors are drawn at its edge."""


def picture(report: dict[str, Any], path: Path) -> None:
    """Draw two panels: CPU time of one run; simulated seconds per CPU second of batches."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    made, panels = plt.subplots(
        1, 2, figsize=(13, 7.6), width_ratios=(8, 5), sharey=True, constrained_layout=True
    )
    one, many = panels
    _lines(one, report["rows"], lambda cpu: 1e6 * cpu)
    one.set_xlabel("CPU time per simulated second [us]")
    one.set_ylabel("largest error in ball angle over the run [rad]")
    one.set_title("one run: further left is better", fontsize=11)
    _lines(many, report["batch"]["rows"], lambda cpu: 1.0 / cpu)
    many.set_xlabel("simulated seconds per CPU second, one core")
    many.set_title("eight runs at once: further right is better", fontsize=11)
    for panel, results, columns in ((one, report["at"], 3), (many, report["batch"]["at"], 2)):
        for result in results:
            panel.axhline(result["error"], color="0.6", linewidth=0.8, zorder=2.1)
        panel.axhspan(LEAST, report["uncertainty"]["angle"], color="0.9", zorder=0)
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_ylim(LEAST, MOST)
        panel.grid(color="0.92")
        panel.xaxis.set_major_formatter("{x:,.0f}")
        panel.xaxis.set_minor_formatter(_some)
        panel.tick_params(axis="x", which="minor", labelsize=7, labelcolor="0.4")
        panel.legend(fontsize=8, ncols=columns, loc="upper center", bbox_to_anchor=(0.5, -0.1))
    try:
        made.savefig(path, dpi=120)
    finally:
        plt.close(made)


def _some(value: float, _: Any) -> str:
    """Return labels only for 2 and 5 times powers of ten, because more of them would overlap."""
    return f"{value:,.0f}" if f"{value:e}"[0] in "25" else ""


def _error(row: dict[str, Any]) -> float:
    return float(row["error"])


def _lines(panel: Any, rows: Sequence[dict[str, Any]], place: Callable[[float], float]) -> None:
    """Draw each method's front as a line, ours first; inferior settings as small dots."""
    methods = dict.fromkeys(row["method"] for row in sorted(rows, key=lambda row: not row["ours"]))
    seen: dict[str, int] = {}
    for method in methods:
        family = next((name for name in COLOURS if method.startswith(name)), "")
        number = seen[family] = seen.get(family, -1) + 1
        look = {"color": COLOURS.get(family, "black"), "linestyle": LINES[number % len(LINES)]}
        mine = sorted((row for row in rows if row["method"] == method), key=_error)
        best = {**look, "marker": "o", "markersize": 4, "label": method}
        beaten = {"color": look["color"], "linestyle": "", "marker": ".", "alpha": 0.35}
        for on_front, style in ((True, best), (False, beaten)):
            shown = [row for row in mine if row["on_front"] is on_front]
            panel.plot(
                [place(row["cpu"]["median"]) for row in shown],
                [max(row["error"], LEAST) for row in shown],
                linewidth=2.0 if mine[0]["ours"] else 1.1,
                **style,
            )

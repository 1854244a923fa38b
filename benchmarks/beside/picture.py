"""Error against time of every method, and the batches beside them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

COLOURS = {"collocation": "tab:red", "rk8": "tab:orange", "heyoka": "tab:blue",
           "CVODE": "tab:green", "ARKODE": "tab:olive", "LSODA": "tab:purple",
           "DOP853": "tab:brown", "MuJoCo": "tab:gray"}  # fmt: skip
LIGHT = 0.75
MARKERS = "osD^v"


def picture(report: dict[str, Any], path: Path) -> None:
    """Two panels: CPU time of one run; simulated seconds per CPU second of batches."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    made, (one, many) = plt.subplots(
        1, 2, figsize=(13, 6.2), width_ratios=(3, 2), constrained_layout=True
    )
    _lines(one, report["rows"], lambda cpu: 1e6 * cpu["median"])
    one.set_xlabel("CPU time per simulated second [us]")
    one.set_ylabel("largest error in ball angle over the run [rad]")
    one.set_title("one run", fontsize=11)
    _lines(many, report["batch"]["rows"], lambda cpu: 1.0 / cpu["median"])
    many.set_xlabel("simulated seconds per CPU second, one core")
    many.set_title("eight runs at once (further right is better)", fontsize=11)
    for panel, results in ((one, report["at"]), (many, report["batch"]["at"])):
        for result in results:
            panel.axhline(result["error"], color="0.8", linewidth=0.8, zorder=0)
        panel.axhspan(1e-16, report["uncertainty"]["angle"], color="0.9", zorder=0)
        panel.set_ylim(1e-14, 1e-2)
    try:
        made.savefig(path, dpi=120)
    finally:
        plt.close(made)


def _lines(panel: Any, rows: Sequence[dict[str, Any]], place: Any) -> None:
    """A line per method, named beside it in the legend, ours first."""
    methods = dict.fromkeys(row["method"] for row in sorted(rows, key=lambda row: not row["ours"]))
    seen: dict[str, int] = {}
    for method in methods:
        mine = sorted((row for row in rows if row["method"] == method), key=lambda r: r["error"])
        family = next((name for name in COLOURS if method.startswith(name)), "")
        number = seen[family] = seen.get(family, -1) + 1
        panel.plot(
            [place(row["cpu"]) for row in mine],
            [max(row["error"], 1e-14) for row in mine],
            color=COLOURS.get(family, "black"),
            linestyle=("-", "--", ":", "-.")[number % 4],
            marker=MARKERS[number % len(MARKERS)],
            markersize=4,
            linewidth=1.8 if mine[0]["ours"] else 1.0,
            alpha=1.0 if number == 0 else LIGHT,
            label=method,
        )
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.grid(color="0.92")
    panel.legend(fontsize=8, loc="upper right")

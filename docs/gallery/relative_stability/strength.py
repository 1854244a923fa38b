"""Figure 3: lambda_Rmax over the spindle's speed and the drag of the race."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from ab_sim import Scene
from ab_sim.analysis.recovery import with_drag
from ab_sim.analysis.result_cache import ResultCache
from gallery.page import PageSection
from gallery.relative_stability.cases import Tell, cases, written
from gallery.relative_stability.resting import strength

RATIOS = tuple(round(0.05 * k, 10) for k in range(1, 101))
DRAGS = (0.05, *(round(0.1 * k, 10) for k in range(1, 11)))
"""[N s/m], Table 2's ranges."""
LEVELS = (-6.0, -3.0, -1.5, -0.8, -0.4, -0.2, -0.1, -0.05, -0.02, -0.01, -0.001, 0.0)
"""[1/s], of the colours."""


def strengths(scene: Scene, ratios: list[float]) -> dict[str, Any]:
    """lambda_Rmax [1/s] over Omega, None where there is no stable state."""
    values = [strength(scene, ratio) for ratio in ratios]
    return {"lambda_max": [None if np.isnan(value) else value for value in values]}


def strength_section(folder: Path, tell: Tell) -> PageSection:
    """Figure 3, as maps instead of surfaces."""
    kept = ResultCache(strengths)
    figure = Figure(figsize=(9, 9), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    for axes, case in zip(panels, cases(), strict=True):
        rows: list[list[float | None]] = []
        for drag in DRAGS:
            done = len(rows) + len(DRAGS) * (case.number - 1)
            tell("figure 3", done, 3 * len(DRAGS))
            rows.append(kept.of(with_drag(case.scene, drag), ratios=list(RATIOS))["lambda_max"])
        growth = np.ma.masked_invalid(np.array(rows, float))
        colours = colormaps["viridis_r"](np.linspace(1.0, 0.0, len(LEVELS)))
        filled = axes.contourf(
            RATIOS, DRAGS, np.minimum(growth, -1e-9), LEVELS, colors=colours, extend="min"
        )
        axes.set_title(case.title, fontsize=10, loc="left")
        axes.set_ylabel("drag of the race [N s/m]")
        axes.set_facecolor("0.85")
        figure.colorbar(filled, ax=axes, label="lambda_Rmax [1/s]", ticks=LEVELS, spacing="uniform")
    panels[-1].set_xlabel("Ω = ω / ω_n [1]")
    caption = "lambda_Rmax of the stable state over speed and drag; grey: no stable state"
    picture = written(figure, folder, 3, caption)
    text = (
        "As published, the state is more stable with less drag, and with more speed from about "
        "Ω = 1.4 (case 1) and 1.6 (case 3). In case 2 lambda_Rmax is 0 above ω_n at every "
        "drag. The grid has steps of 0.05 in Ω.",
    )
    return PageSection("Strength over speed and drag: figure 3, Table 2", text, (), (picture,))

"""Figure 8 of 2010: the rig without balls."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gallery.page import PageSection, Table
from gallery.two_plane.rig import TABLE_2
from gallery.two_plane.rig_frequencies import MEASURED
from gallery.two_plane.rig_levels import plain
from gallery.two_plane.rotor import Tell, written

WASHERS = 3
PRINTED = {
    1000: 0.0235, 1200: 0.0540, 1400: 0.268, 1550: 0.203, 1600: 0.208, 1800: 0.225,
    1860: 0.198, 2000: 0.130, 2060: 0.1215, 2100: 0.131, 2200: 0.206, 2400: 0.145,
    2500: 0.0882, 3000: 0.0513, 4000: 0.0390, 5000: 0.0353,
}  # fmt: skip
"""The paper's simulated curve, by rpm [mm]."""
OVER = np.arange(600.0, 5201.0, 20.0)


def plain_section(folder: Path, tell: Tell) -> PageSection:
    """The curve, and the printed one."""
    rows = []
    for rpm, printed in PRINTED.items():
        found = plain(TABLE_2[WASHERS], rpm)
        rows.append((f"{rpm}", printed, 1e3 * found.of_mean, 1e3 * found.of_maxima))
    names = "speed [rpm]", "printed", "ours, largest mean", "ours, mean of largest (3)"
    table = Table(f"Vibration with {WASHERS} washers, without balls [mm]", names, tuple(rows), 3)
    tell("the rig without balls", 0, 1)
    levels = [plain(TABLE_2[WASHERS], rpm) for rpm in OVER.tolist()]
    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.semilogy(OVER, [1e3 * level.of_mean for level in levels], color="tab:blue", label="ours")
    axes.semilogy(
        OVER, [1e3 * level.of_maxima for level in levels], color="tab:blue", ls=":",
        label="ours, (3)",
    )  # fmt: skip
    axes.semilogy([*PRINTED], [*PRINTED.values()], "x", color="tab:red", label="printed simulation")
    for measured in MEASURED:
        axes.axvline(measured, color="0.6", lw=0.8, ls="--", zorder=0)
    axes.set_xlabel("spindle speed [rpm]")
    axes.set_ylabel("vibration [mm]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=9)
    caption = "Figure 8, without balls; dashed: the measured critical speeds"
    text = (
        "Parameters of tables 1 to 3, with the stiffness doubled. Slip: (3) defines the level "
        "as the mean of the two bearings' largest displacements, but the printed curve is the "
        "largest mean of both at one instant. Between the conical peaks (3) gives a quarter "
        "more.",
    )
    return PageSection(
        "The rig without balls: figure 8", text, (table,),
        (written(figure, folder, "rig-plain", caption),),
    )  # fmt: skip

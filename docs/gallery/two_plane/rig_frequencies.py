"""The rig's critical speeds, and what its tables leave open."""

import cmath
import math

import numpy as np

from gallery.page import Cell, PageSection, Table
from gallery.two_plane.frequencies import critical_speeds
from gallery.two_plane.rig import (
    BALLS_AT,
    DOUBLED,
    POLAR,
    RPM,
    TABLE_2,
    TRANSVERSE,
    WASHER,
    rig,
)

MEASURED = (1415.0, 1675.0, 1944.0, 2310.0)
"""Printed in figure 7 [rpm]."""
SIMULATED = (1455.0, 1700.0, 1920.0, 2280.0)
"""Peaks that the paper's own simulation has, figure 8 [rpm]."""
NAMES = ("cylindrical, Y", "cylindrical, X", "conical, Y", "conical, X")


def rig_critical_speeds(multiplied: float) -> list[float]:
    """With the printed stiffness multiplied [rpm]."""
    return [speed / RPM for speed in critical_speeds(rig(TABLE_2[3], multiplied), 4000.0 * RPM)]


def washer_plane() -> tuple[complex, float]:
    """Table 2 taken apart: misalignment without washers, and where these lie.

    Returns
    -------
    tuple[complex, float]
        The misalignment chi exp(-i beta) that the disc has without washers, from the direction of
        their unbalance [rad]; the height of their plane from C [m].
    """
    washers = np.array([row.washers for row in TABLE_2[1:]])
    found = np.array([_misaligned(row.misalignment, row.phase) for row in TABLE_2[1:]])
    slope, own = np.polyfit(washers, found, 1)
    return complex(own), float(slope.real) * (TRANSVERSE - POLAR) / WASHER


def _misaligned(size: float, phase: float) -> complex:
    return cmath.rect(size, -math.radians(phase))


def rig_frequency_section() -> PageSection:
    """Measured, simulated in the paper, and ours."""
    single, doubled = rig_critical_speeds(1.0), rig_critical_speeds(DOUBLED)
    rows = tuple(zip(NAMES, MEASURED, SIMULATED, single, doubled, strict=True))
    names = "mode", "measured", "the paper's simulation", "ours, as printed", "ours, doubled"
    table = Table("Critical speeds of the rig [rpm]", names, rows, 5)
    own, plane = washer_plane()
    parts: list[tuple[Cell, ...]] = []
    for row in TABLE_2:
        whole = own + row.washers * plane * WASHER / (TRANSVERSE - POLAR)
        phase = -math.degrees(cmath.phase(whole)) % 360.0
        known = row.phase if row.washers else None
        parts.append(
            (row.washers, 1e5 * row.misalignment, 1e5 * abs(whole), known, phase)
        )  # fmt: skip
    names = "washers", "chi, printed [1e-5 rad]", "ours", "beta, printed [deg]", "ours"
    apart = Table("Table 2 from two unknowns", names, tuple(parts), 3)
    text = (
        "The rig has one race with two balls. It is included because its tables are complete "
        "and its peaks were measured.",
        "Slip: with the bearing stiffness of table 3 (10 750 and 7900 N/m) the critical speeds "
        "are too low by sqrt 2. Twice the stiffness gives the paper's simulated peaks within "
        ".2 % and the measured ones within 3.1 %. Table 3 may print the stiffness of one "
        "spring of a bearing. The damping, 2.5e-4 s times the stiffness, doubles too.",
        "The position of the washers is not printed. Table 2 implies an unbalance at z = "
        f"{1e3 * plane:.1f} mm, {1e3 * abs(plane - BALLS_AT):.0f} mm beyond the balls' plane. "
        f"With the disc's own couple ({1e5 * abs(own):.2f}e-5 rad, printed 6.1e-5), all of "
        "table 2 follows to its last digit.",
    )
    return PageSection("The rig of 2010: critical speeds", text, (table, apart))

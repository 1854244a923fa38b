"""What unbalance figure 14 of 2010 was drawn with: found from its curve without balls."""

import math

import numpy as np
from scipy.optimize import least_squares

from gallery.two_plane.printed import printed_turn
from gallery.two_plane.rig import BEARINGS_AT, RPM, TABLE_2, Unbalance, rig

CURVE = {
    800: 0.0077, 1200: 0.0359, 1400: 0.1772, 1560: 0.1255, 1800: 0.1488, 1920: 0.1555,
    2000: 0.0910, 2040: 0.0838, 2120: 0.0971, 2200: 0.1443, 2320: 0.1835, 2520: 0.0556,
    3040: 0.0334, 3940: 0.0262, 5140: 0.0234,
}  # fmt: skip
"""Figure 14, without balls, two washers: vibration by rpm [mm]."""


def misfits(unbalance: Unbalance) -> np.ndarray:
    """Of the curve, relative, at each of its points."""
    found = []
    for rpm, printed in CURVE.items():
        turns = [np.abs(printed_turn(rig(unbalance), rpm * RPM, at)) for at in BEARINGS_AT]
        found.append(math.log(500.0 * float(sum(turns).max()) / printed))
    return np.array(found)


def identified() -> Unbalance:
    """The unbalance that fits best, from table 2's."""
    start = TABLE_2[2]
    size = np.array([start.eccentricity, start.misalignment, start.phase])

    def misfit(x: np.ndarray) -> np.ndarray:
        eccentricity, misalignment, phase = (x * size).tolist()
        return misfits(Unbalance(start.washers, eccentricity, misalignment, phase))

    eccentricity, misalignment, phase = (least_squares(misfit, np.ones(3)).x * size).tolist()
    return Unbalance(start.washers, eccentricity, misalignment, phase)

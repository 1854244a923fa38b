"""Start-ups judged by the thesis' measure, and by what a drive is judged by."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gallery.thesis.drive import THESIS, Period, Tell
from gallery.thesis.many import End, ends

PRINTED = {0.0: {0.4: 0.77, 0.5: 0.86, 0.6: 0.91}, 20.0: {0.4: 0.88, 0.5: 0.58, 0.6: 0.59}}
"""Settling periods [s], by acceleration in the period [rad/s^2] and its duration [s]."""
NAMES = {0.0: "constant speed", 20.0: "half the acceleration"}
LINE = np.round(np.arange(0.2, 1.0001, 0.02), 3)
"""Durations of the fine line [s]."""
SPEEDS = np.round(np.arange(80.0, 140.1, 2.0), 3)
"""Start speeds of the grid [rad/s]."""
DURATIONS = np.round(np.arange(0.05, 1.201, 0.05), 3)
"""Of the grid [s]."""
JUDGED_FOR = 14.0
"""Runs that are judged as a drive is go on for so long [s], to a target of 200 rad/s."""


class Judged(NamedTuple):
    """A start-up by the thesis' measure, and by what a drive is judged by."""

    settling: float | None
    """From the period's start until both balls first are at -180 deg or beyond [s]."""
    end: End


def judged(what: str, periods: Sequence[Period | None], tell: Tell) -> list[Judged]:
    """Start-ups to 200 rad/s, run for ``JUDGED_FOR``."""
    found = ends(what, [(THESIS, period) for period in periods], tell, 200.0, JUDGED_FOR)
    return [
        Judged(None if end.opposite is None else end.opposite - _start(period), end)
        for end, period in zip(found, periods, strict=True)
    ]


def grid_of(tell: Tell) -> dict[float, list[list[Judged]]]:
    """By acceleration in the period, start speed and duration."""
    found = {}
    for acceleration in PRINTED:
        periods = [
            Period(float(speed) / 40.0, float(duration), acceleration)
            for speed in SPEEDS
            for duration in DURATIONS
        ]
        what = f"section 4.4, start speed and duration, {NAMES[acceleration]}"
        flat = judged(what, periods, tell)
        width = len(DURATIONS)
        found[acceleration] = [flat[k : k + width] for k in range(0, len(flat), width)]
    return found


def _start(period: Period | None) -> float:
    """From when on settling counts [s]."""
    return THESIS.critical_time if period is None else period.start

"""Section 4.5, (1) and (2): whether an end time that section 4.4 found best scales with the drive.

The thesis takes an end time that "has been already optimized" by section 4.4 and scales it. The
best hold of figure 4.23 is 0.4 s; its own figures 4.27 to 4.31 have the 0.5 s of section 4.2.
"""

import numpy as np

from gallery.thesis.claims import Claim, degrees
from gallery.thesis.drive import THESIS, Parameters, Period, StartUp, start_ups
from gallery.thesis.settling import TRIED

BEST = 0.4
"""Hold that is soonest in figure 4.23, at constant speed [s]."""


def optimum_claim(figure: str, law: str, p: Parameters) -> Claim:
    """That the scaled best hold is the soonest of the scaled holds of figure 4.23."""
    factor = p.critical_time / THESIS.critical_time
    runs = scaled_holds(p)
    times = [np.inf if run.settling is None else run.settling for run in runs]
    known = np.isfinite(times).any()
    best = TRIED[int(np.argmin(times))] if known else None
    each = ", ".join(f"{time:.2f}" for time in times)
    reached = f"{each.replace('inf', 'never')} s after its start" if known else "never"
    last = runs[TRIED.index(BEST)]
    found = f"{best:g} s is, times {factor:.3f}" if known else "none gets there"
    return Claim(
        figure, f"the end time of section 4.4, a hold of {BEST:g} s, scaled as {law}: best again",
        f"at -180 deg {reached} with {', '.join(f'{d:g}' for d in TRIED)} s, each "
        f"times {factor:.3f}; {degrees(last.angles)} at last with {BEST:g} s (ours: soonest)",
        best == BEST, f"{found}; with {BEST:g} s they first turn back at {turns(last):.0f} deg",
    )  # fmt: skip


def turns(run: StartUp) -> float:
    """Where the balls' mean first turns back above the critical speed [deg]."""
    late = run.trajectory["time"] > run.parameters.critical_time
    angles = np.degrees(run.trajectory.ball_angles[late].mean(axis=1))
    return float(angles[int(np.argmax(np.diff(angles) > 0.0))])


def scaled_holds(p: Parameters) -> list[StartUp]:
    """The holds of figure 4.23 at constant speed, with start and duration scaled to a drive."""
    factor = p.critical_time / THESIS.critical_time
    return start_ups([(p, Period(p.critical_time, d * factor)) for d in TRIED])

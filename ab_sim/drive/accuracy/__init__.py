"""Choice of a solver for a requested accuracy, and error estimates of live runs."""

from ab_sim.drive.accuracy.search import SAFETY, WorkPrecision, cheapest, resolve_accuracy, share_of
from ab_sim.drive.accuracy.trials import Run, Timed

__all__ = [
    "SAFETY",
    "WorkPrecision",
    "Run",
    "Timed",
    "cheapest",
    "resolve_accuracy",
    "share_of",
]

"""Choice of a solver for a requested accuracy, and error estimates of live runs."""

from ab_sim.drive.accuracy.resolve import resolve_accuracy
from ab_sim.drive.accuracy.search import cheapest
from ab_sim.drive.accuracy.trials import Run, Timed
from ab_sim.drive.accuracy.work_precision import SAFETY, WorkPrecision, share_of

__all__ = [
    "SAFETY",
    "WorkPrecision",
    "Run",
    "Timed",
    "cheapest",
    "resolve_accuracy",
    "share_of",
]

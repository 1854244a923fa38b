"""Offline runs of a scene, alone or compared, with their metrics and further analyses."""

from ab_sim.analysis.comparison import Compared, Comparison, without_balls, without_period
from ab_sim.analysis.metrics import Metrics, metrics_of, metrics_of_blocks
from ab_sim.analysis.offline import OfflineRun, compare_run, run_scene
from ab_sim.analysis.replay import replay
from ab_sim.analysis.startup import (
    first_passage_of_opposite,
    peak_whirl,
    time_of_speed,
)
from ab_sim.drive.closed_forms import driving_forces

__all__ = [
    "Compared",
    "Comparison",
    "Metrics",
    "OfflineRun",
    "compare_run",
    "driving_forces",
    "first_passage_of_opposite",
    "metrics_of",
    "metrics_of_blocks",
    "peak_whirl",
    "replay",
    "run_scene",
    "time_of_speed",
    "without_balls",
    "without_period",
]

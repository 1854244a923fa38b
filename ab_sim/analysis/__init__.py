"""What a run shows: peak whirl, settling period, driving force; and running a scene offline."""

from ab_sim.analysis.offline import OfflineRun, run_scene
from ab_sim.analysis.replay import replay
from ab_sim.analysis.startup import driving_forces, peak_whirl, settling_period, time_of_speed

__all__ = [
    "OfflineRun",
    "driving_forces",
    "peak_whirl",
    "replay",
    "run_scene",
    "settling_period",
    "time_of_speed",
]

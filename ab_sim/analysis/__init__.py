"""What a run shows: peak whirl, settling period, driving force; and running a scene offline."""

from ab_sim.analysis.offline import OfflineRun, run_scene
from ab_sim.analysis.startup import driving_force, peak_whirl, settling_period, time_of_speed

__all__ = [
    "OfflineRun",
    "driving_force",
    "peak_whirl",
    "run_scene",
    "settling_period",
    "time_of_speed",
]

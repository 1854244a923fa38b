"""What an accuracy costs for one scene: a work-precision study of all steppers and of peers.

    accuracy = measure(load_scene("thesis-hold", ["effects.rolling_friction="]))
    accuracy.cheapest(1e-9)  # the Row with the least CPU time at that error in ball angle

Every method runs the same scene, with the same equations where it takes a right-hand side, and is
compared with one reference at common sample times.
"""

from ab_sim.studies.accuracy_cost.results import Accuracy, Bound, Errors, LeftOut, Row
from ab_sim.studies.accuracy_cost.study import REPEATS, measure

__all__ = ["REPEATS", "Accuracy", "Bound", "Errors", "LeftOut", "Row", "measure"]

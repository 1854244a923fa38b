"""Work-precision study of one scene, with all steppers and with other packages' integrators.

    cost = accuracy_cost(load_scene("thesis-hold", ["effects.rolling_friction="]))
    cost.cheapest(1e-9)  # the SettingCost with the least CPU time at that error in ball angle

All methods run the same scene and are compared with one reference at common sample times. Methods
that take a right-hand side get this package's equations.
"""

from ab_sim.analysis.accuracy_cost.results import (
    AccuracyCost,
    ErrorBound,
    OmittedMethod,
    RunErrors,
    SettingCost,
)
from ab_sim.analysis.accuracy_cost.study import REPEATS, accuracy_cost

__all__ = [
    "REPEATS",
    "AccuracyCost",
    "ErrorBound",
    "RunErrors",
    "OmittedMethod",
    "SettingCost",
    "accuracy_cost",
]

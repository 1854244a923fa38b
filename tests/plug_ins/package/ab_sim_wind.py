"""Plug-in with wind on the deck, a stepper, and a metric: the process that judged a run."""

import os
from typing import NamedTuple

import ab_sim


@ab_sim.register_effect("wind", equation="f = F", source="tests")
class Wind(NamedTuple):
    """Constant force on the deck."""

    force: float

    def deck_force(self, deck):
        return self.force, 0.0


@ab_sim.register_metric("judged_by", meaning="process that judged the run")
class JudgedBy:
    """Process id as a metric."""

    def __init__(self, scene, samples):
        pass

    def take(self, piece):
        pass

    def value(self):
        return float(os.getpid())


ab_sim.register_stepper("heun_of_tests", 2, "Heun (1900)", rows=[[1.0]], weights=[0.5, 0.5])

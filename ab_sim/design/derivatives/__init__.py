"""Derivatives of a run by the scene's values, by differences of whole runs.

keys          values of a scene by their dotted keys, and the scene with another value
differences   derivatives and their uncertainty
channels      derivatives of a run's channels
of_merits     derivatives of a run's merits
"""

from ab_sim.design.derivatives.channels import Sensitivities, sensitivities
from ab_sim.design.derivatives.keys import real_keys
from ab_sim.design.derivatives.of_merits import MeritSensitivities, merit_sensitivities

__all__ = [
    "MeritSensitivities",
    "Sensitivities",
    "merit_sensitivities",
    "real_keys",
    "sensitivities",
]

"""Derivatives of a run by the scene's values, by differences of whole runs.

keys          values of a scene by their dotted keys, and the scene with another value
differences   derivatives and their uncertainty
channels      derivatives of a run's channels
of_metrics    derivatives of a run's metrics
"""

from ab_sim.design.derivatives.channels import Sensitivities, sensitivities
from ab_sim.design.derivatives.keys import real_keys
from ab_sim.design.derivatives.of_metrics import MetricSensitivities, metric_sensitivities

__all__ = [
    "MetricSensitivities",
    "Sensitivities",
    "metric_sensitivities",
    "real_keys",
    "sensitivities",
]

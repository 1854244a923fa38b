"""Metrics of a run; all of them are declared in ``declared.Metrics``."""

from ab_sim.analysis.metrics.accumulators import BAND, FLOOR, rms
from ab_sim.analysis.metrics.declared import Metrics
from ab_sim.analysis.metrics.metric import described_metrics, reported_metrics
from ab_sim.analysis.metrics.of_run import metrics_of, metrics_of_blocks, passes_of

__all__ = [
    "BAND",
    "FLOOR",
    "Metrics",
    "described_metrics",
    "reported_metrics",
    "metrics_of",
    "metrics_of_blocks",
    "passes_of",
    "rms",
]

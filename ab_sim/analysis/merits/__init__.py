"""Metrics of a run; all of them are declared in ``declared.Merits``."""

from ab_sim.analysis.merits.declared import Merits
from ab_sim.analysis.merits.judging import LAST
from ab_sim.analysis.merits.merit import described_merits, reported_merits
from ab_sim.analysis.merits.of_run import merits_of, merits_of_pieces, passes_of
from ab_sim.analysis.merits.watches import BAND, FLOOR, rms

__all__ = [
    "BAND",
    "FLOOR",
    "LAST",
    "Merits",
    "described_merits",
    "reported_merits",
    "merits_of",
    "merits_of_pieces",
    "passes_of",
    "rms",
]

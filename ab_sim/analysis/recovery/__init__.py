"""Recovery of a drive from a change of spindle speed, and the best drag for it."""

from ab_sim.analysis.recovery.over_drag import (
    DRAGS,
    Composite,
    RecoveryOverDrag,
    composite_of,
    in_one_ball,
    recovery_over_drag,
)
from ab_sim.analysis.recovery.response import BAND, Recovery, recover

__all__ = [
    "BAND",
    "DRAGS",
    "Composite",
    "Recovery",
    "RecoveryOverDrag",
    "composite_of",
    "in_one_ball",
    "recover",
    "recovery_over_drag",
]

"""Result types of the functions of ``ab_sim``, for annotations."""

from ab_sim.analysis import Comparison, Metrics, OfflineRun
from ab_sim.analysis.accuracy_cost import AccuracyCost
from ab_sim.analysis.effect_cost import EffectCost
from ab_sim.analysis.equilibria import Equilibria, RestingState
from ab_sim.analysis.floquet import Followed, Stability
from ab_sim.analysis.maps.stability import StabilityMap
from ab_sim.analysis.modes import Mode, NaturalVibration
from ab_sim.analysis.recovery import Recovery, RecoveryOverDrag
from ab_sim.api.results import BranchesOverSpeed, PeriodicSolutions
from ab_sim.design.basin import Basin
from ab_sim.design.batch import Batch
from ab_sim.design.derivatives import MetricSensitivities, Sensitivities
from ab_sim.design.sizing.size import Sizing
from ab_sim.design.spread import Spread
from ab_sim.design.sweep import Sweep
from ab_sim.design.tune import Tuning
from ab_sim.drive.accuracy import WorkPrecision
from ab_sim.drive.observation import Observation
from ab_sim.identification.result import Identification
from ab_sim.record.recording import StoredRun
from ab_sim.show.compare import RecordingComparison

__all__ = [
    "AccuracyCost",
    "Basin",
    "Batch",
    "RecordingComparison",
    "BranchesOverSpeed",
    "Comparison",
    "EffectCost",
    "Equilibria",
    "Followed",
    "Identification",
    "MetricSensitivities",
    "Metrics",
    "Mode",
    "Observation",
    "OfflineRun",
    "PeriodicSolutions",
    "WorkPrecision",
    "Recovery",
    "RecoveryOverDrag",
    "RestingState",
    "Sensitivities",
    "Sizing",
    "Spread",
    "Stability",
    "StabilityMap",
    "StoredRun",
    "Sweep",
    "Tuning",
    "NaturalVibration",
]

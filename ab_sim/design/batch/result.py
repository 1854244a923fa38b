"""Result of a batch of runs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ab_sim.base.presentation import Column, Columns, Presented, ends, number
from ab_sim.design.batch.prepared_run import BatchRun


@dataclass(frozen=True, repr=False)
class Batch(Presented):
    """Runs in the order of their variations; see ``ab_sim.simulate_batch``."""

    _picture = "batch"

    runs: tuple[BatchRun, ...]
    """Runs with their samples; empty if only metrics were requested."""
    in_lanes: int
    """Number of runs computed in lanes, up to eight at once.

    The last runs of a group may have unused lanes. The other runs were computed one by one.
    """
    integration_seconds: float
    """CPU time of this thread for the steps of all runs [s].

    For runs one by one it includes the compilation of kernels for further kinds of profile
    segments.
    """
    variations: Sequence[Mapping[str, object]] = ()
    """Varied values by dotted key, for each run."""
    metrics: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Requested metrics by key as in reports, shape (runs,).

    Numbers are floats, NaN for null and for failed runs; other values are None there. Metrics of an
    aborted run describe its way to standstill; final values have no meaning.
    """
    failures: tuple[str, ...] = ()
    """Reason of each run's early end; empty if complete."""
    aborted: tuple[str, ...] = ()
    """Reason of each run's abort to standstill by its profile controller; empty if not aborted."""
    scene_name: str = ""
    """Name of the common scene."""

    def __len__(self) -> int:
        return len(self.failures)

    def _facts(self) -> dict[str, str]:
        failed, aborted = (sum(map(bool, why)) for why in (self.failures, self.aborted))
        facts = {
            "scene": self.scene_name,
            "runs": str(len(self)),
            "in lanes": str(self.in_lanes),
        }
        # Leave out aborted runs: they have no whirl at standstill.
        kept = [run.trajectory for run in self.runs if len(run.trajectory) and not run.aborted]
        if kept:
            last = [float(path.whirl[-1]) for path in kept]
            facts["until"] = number(max(path["time"][-1] for path in kept), "s")
            facts["W at the end"] = ends(min(last), max(last), "m")
        for key, values in self.metrics.items():
            finite = values[np.isfinite(values)] if values.dtype == float else values[:0]
            if len(finite):
                facts[key] = ends(finite.min(), finite.max(), "")
        facts |= {"aborted": str(aborted)} if aborted else {}
        return facts | ({"diverged": str(failed)} if failed else {})

    def _columns(self) -> Columns:
        keys = dict.fromkeys(key for variation in self.variations for key in variation)
        columns = {
            key: Column(None, [variation.get(key) for variation in self.variations]) for key in keys
        }
        if self.runs:
            paths = [run.trajectory for run in self.runs]
            whirls = [path.whirl for path in paths]
            columns |= {
                "samples": Column("1", [len(path) for path in paths]),
                "end": Column("s", [_last(path["time"]) for path in paths]),
                "speed": Column("rad/s", [_last(path["speed"]) for path in paths]),
                "peak_whirl": Column("m", [float(whirl.max(initial=0.0)) for whirl in whirls]),
                "whirl": Column("m", [_last(whirl) for whirl in whirls]),
            }
        columns |= {key: Column(None, values) for key, values in self.metrics.items()}
        columns |= {"aborted": Column(None, self.aborted)} if any(self.aborted) else {}
        return columns | {"failure": Column(None, self.failures)}


def _last(values: np.ndarray) -> float:
    return float(values[-1]) if len(values) else math.nan

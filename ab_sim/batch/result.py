"""What a batch of runs has come to."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ab_sim.batch.prepared_run import BatchRun
from ab_sim.presentation import Column, Columns, Presented, ends, number


@dataclass(frozen=True, repr=False)
class Batch(Presented):
    """Runs in the order of their variations; see ``ab_sim.simulate_batch``."""

    _picture = "batch"

    runs: tuple[BatchRun, ...]
    """With their samples; none where only merits were asked for."""
    in_lanes: int
    """Number of runs that ran in lanes, up to eight at once; what is left over of runs that are
    alike may be alone there. The others ran one by one."""
    integration_seconds: float
    """CPU time of this thread for taking the steps, all runs together [s]. Of runs that go one by
    one, a kernel for a further kind of the profile's segments is made in it, too."""
    variations: Sequence[Mapping[str, object]] = ()
    """What is varied, values by dotted key for each run."""
    merits: Mapping[str, np.ndarray] = field(default_factory=dict)
    """By key those that were asked for, as reports give them, shape (runs,). Numbers are floats,
    NaN where a report has null and of runs that failed; of what else there is, None stands there.
    Those of an aborted run are of its way to standstill: final ones say nothing."""
    failures: tuple[str, ...] = ()
    """Why each run ended early; empty if it did not."""
    aborted: tuple[str, ...] = ()
    """Why each run's profile, which decides while it runs, ran down to standstill; empty if it did
    not."""
    scene_name: str = ""
    """Of what the runs have in common."""

    def __len__(self) -> int:
        return len(self.failures)

    def _facts(self) -> dict[str, str]:
        failed, aborted = (sum(map(bool, why)) for why in (self.failures, self.aborted))
        facts = {
            "scene": self.scene_name,
            "runs": str(len(self)),
            "in lanes": str(self.in_lanes),
        }
        # At standstill nothing whirls.
        kept = [run.trajectory for run in self.runs if len(run.trajectory) and not run.aborted]
        if kept:
            last = [float(path.whirl[-1]) for path in kept]
            facts["until"] = number(max(path["time"][-1] for path in kept), "s")
            facts["W at the end"] = ends(min(last), max(last), "m")
        for key, values in self.merits.items():
            known = values[np.isfinite(values)] if values.dtype == float else values[:0]
            if len(known):
                facts[key] = ends(known.min(), known.max(), "")
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
        columns |= {key: Column(None, values) for key, values in self.merits.items()}
        columns |= {"aborted": Column(None, self.aborted)} if any(self.aborted) else {}
        return columns | {"failure": Column(None, self.failures)}


def _last(values: np.ndarray) -> float:
    return float(values[-1]) if len(values) else math.nan

"""Share of random drives of a sizing that is balanced in time, from runs."""

from contextlib import AbstractContextManager
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.base.presentation import Progress
from ab_sim.design.draws import DrawnPoints
from ab_sim.design.intervals import ShareBalanced, share_of
from ab_sim.design.judged import FAILED, FAILURE, OUTCOME, Job
from ab_sim.design.scores import metric_values
from ab_sim.design.sizing.specification import DriveSpecification
from ab_sim.design.spread_runs import Executors
from ab_sim.design.tolerances import Tolerance, tolerance_of
from ab_sim.design.work import Executor, rows_of
from ab_sim.scene.model import Scene

GRADE, PEAK = "balance_grade", "peak_whirl_over_e"
GRADE_UNIT = 1e3
"""Factor from m/s to the metric's unit, mm/s."""


class SpreadRuns(NamedTuple):
    """Runs of one design over its spread."""

    share: ShareBalanced
    """Share of drives within the allowed residual unbalance and without circulating balls."""
    circulating: int
    """Number of runs that end with circulating balls."""
    failed: int
    failure: str | None
    """Error message of the first failed run."""
    peak_whirl: float
    """Median of the largest whirl during the start-up [m]."""

    def report(self) -> dict[str, Any]:
        """Return the runs as JSON-able values."""
        return {**self._asdict(), "share": {**self.share._asdict(), "value": self.share.value}}


class Running(NamedTuple):
    """Number of runs, their seed, and how they are executed."""

    runs: int
    seed: int
    executors: Executors | None
    """Function that creates an executor; None for this process."""
    tell: Progress | None

    def at_stage(self, name: str) -> "Running":
        """Return these settings with a stage's name in front of each progress message."""
        tell = self.tell
        if tell is None:
            return self

        def tell_stage(what: str, done: int, total: int) -> None:
            tell(f"{name}: {what}", done, total)

        return self._replace(tell=tell_stage)

    def executor(self) -> AbstractContextManager[Executor] | None:
        """Return the executor for one study."""
        return None if self.executors is None else self.executors()


def tolerances_of(specification: DriveSpecification, drag_too: bool = True) -> list[Tolerance]:
    """Return the tolerances of unbalance, start angles and, if ``drag_too``, drag."""
    mass = specification.mass
    low, high = specification.least_unbalance / mass, specification.largest_unbalance / mass
    written = [f"rotor.eccentricity=uniform:{low!r},{high!r}", "start.ball_angles=random"]
    if drag_too and specification.drag_tolerance > 0.0:
        percent = 100.0 * specification.drag_tolerance
        written.append(f"effects.viscous_drag.coefficient=uniform:{percent!r}%")
    return [tolerance_of(text) for text in written]


def run_share(
    scene: Scene, specification: DriveSpecification, running: Running, drag_too: bool = True
) -> SpreadRuns:
    """Run a design over its spread.

    Unlike ``robust``, a drive with an unsettled whirl can count as balanced: only its residual
    unbalance at the end of the settling time counts.

    Args:
        scene: nominal scene.
        specification: specification with spread and allowed residual.
        running: settings of the runs.
        drag_too: whether the drag varies as well.
    """
    drawn = DrawnPoints(scene, tolerances_of(specification, drag_too), running.runs, running.seed)
    job = Job(scene, drawn.keys, (GRADE, PEAK))
    rows = rows_of(job, drawn, running.executor(), running.tell)
    outcomes = np.array(rows[OUTCOME].to_pylist())
    limit = GRADE_UNIT * specification.limit / scene.total_mass * specification.speed
    balanced = (metric_values(rows, GRADE) <= limit) & (outcomes != Verdict.CIRCULATES.value)
    keys = drawn.keys.index("rotor.eccentricity")
    whirls = metric_values(rows, PEAK) * [drawn.at(run)[keys] for run in range(len(drawn))]
    failures = [failure for failure in rows[FAILURE].to_pylist() if failure]
    return SpreadRuns(
        share_of(balanced),
        int(np.count_nonzero(outcomes == Verdict.CIRCULATES.value)),
        int(np.count_nonzero(outcomes == FAILED)),
        failures[0] if failures else None,
        float(np.nanmedian(whirls)) if np.isfinite(whirls).any() else float("nan"),
    )

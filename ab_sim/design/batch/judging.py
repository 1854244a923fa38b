"""Evaluation of runs as they are computed: samples stay in memory until metrics are known."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.metrics.judging import JudgedRuns
from ab_sim.analysis.metrics.metric import metrics_named
from ab_sim.analysis.metrics.of_run import metrics_of_runs
from ab_sim.base.presentation import CountProgress
from ab_sim.design.batch.lane_group import LaneGroup, LaneStarts
from ab_sim.design.batch.prepared_run import BatchRun, PreparedRun, StepPlanKey, grouped
from ab_sim.design.batch.run_columns import RunColumns
from ab_sim.design.batch.run_prepared import DoneRuns, run_prepared
from ab_sim.drive.trajectory import column_of, whirl_of
from ab_sim.engine.stepping.side_by_side import LANES, LaneSamples

SAMPLES_AT_ONCE = 2**22
"""Number of sample values in memory at a time, 32 MB.

Blocks of this size cover enough runs to make the overhead of numpy's calls small.
"""

_COPIED_AT_ONCE = 2**22
"""Largest number of sample values that are copied at a time into one contiguous array."""


class JudgedPart(NamedTuple):
    """Results of some runs."""

    runs: np.ndarray
    """Indices of the runs."""
    metrics: dict[str, list[Any]]
    """Metrics by key as in reports; None for failed runs."""
    failures: Sequence[str]
    """Reason of each run's early end; empty if complete."""
    aborts: Sequence[str]
    """Reason of each run's abort to standstill; empty if not aborted."""
    in_lanes: bool
    """True if the runs were computed in lanes."""
    seconds: float
    """CPU time of the steps [s]."""


class _PreparedGroup:
    """Prepared runs of one group; the methods are those of ``RunColumns``."""

    def __init__(self, runs: Sequence[PreparedRun]) -> None:
        self.first, self._runs = runs[0], runs

    def starts(self, rows: np.ndarray) -> LaneStarts:
        """Return the start data of the runs with some indices."""
        return LaneStarts.of([self._runs[row] for row in rows])

    def step_plan_keys(self, rows: np.ndarray) -> Sequence[StepPlanKey]:
        """Return the step plan keys of the runs with some indices."""
        return [self._runs[row].step_plan_key for row in rows]

    def judged(self, rows: np.ndarray) -> JudgedRuns:
        """Return the data that metrics need of the runs with some indices."""
        return JudgedRuns([self._runs[row].scene for row in rows], self.first.steps)


def judged_parts(
    columns: RunColumns | None, prepared: Mapping[int, PreparedRun], keys: Sequence[str]
) -> Iterator[JudgedPart]:
    """Run the simulations, and yield their metrics in parts.

    Parameters
    ----------
    columns
        Runs whose values are stored by column; None if there are none.
    prepared
        All other runs, by number.
    keys
        Keys of the metrics.
    """
    if columns is not None:
        yield from _in_lanes(columns, columns.valid, columns.valid, keys)
    numbers = list(prepared)
    for members in grouped(list(prepared.values())).values():
        runs = np.array([numbers[i] for i in members])
        group = [prepared[run] for run in runs.tolist()]
        if group[0].fits_lane and not group[0].scene.pickups:
            yield from _in_lanes(_PreparedGroup(group), np.arange(len(group)), runs, keys)
            continue
        for chosen, done, metrics in _with_metrics(group, keys):
            failures, aborts = zip(*((run.failure, run.aborted) for run in done.runs), strict=True)
            in_lanes, seconds = done.in_lanes > 0, done.integration_seconds
            yield JudgedPart(runs[chosen], metrics, failures, aborts, in_lanes, seconds)


def _in_lanes(
    source: RunColumns | _PreparedGroup, rows: np.ndarray, numbers: np.ndarray, keys: Sequence[str]
) -> Iterator[JudgedPart]:
    """Compute the runs of a group side by side, and yield their metrics in parts.

    Samples are evaluated while they are in memory, and the memory is reused for the next part.

    Parameters
    ----------
    source
        Source of these runs.
    rows
        Row of each run in the source.
    numbers
        Number of each run in the batch.
    keys
        Keys of the metrics.
    """
    first = source.first
    lane_group, most = LaneGroup(first, 1), _at_once(first)
    memory = _SampleMemory(first, min(most, len(rows) + LANES))
    for begin in range(0, len(rows), most):
        part, seconds = rows[begin : begin + most], 0.0
        starts, finite_steps = source.starts(part), np.zeros(len(part), int)
        for place in range(0, len(part), LANES):
            eight = slice(place, min(place + LANES, len(part)))
            keys_of_eight = source.step_plan_keys(part[eight])
            steps, spent = lane_group.run(starts.rows(eight), keys_of_eight, memory.eight(place))
            finite_steps[eight], seconds = steps[: eight.stop - place], seconds + spent
            memory.compute_whirl(place)
        failures = [first.failure_after(steps) for steps in finite_steps.tolist()]
        complete = np.flatnonzero(finite_steps >= first.steps)
        runs, kept = source.judged(part[complete]), memory.of(complete)
        metrics = _reported(runs, first.channels, keys, *kept)
        spread = {key: _spread(values, complete, len(part)) for key, values in metrics.items()}
        yield JudgedPart(
            numbers[begin : begin + most], spread, failures, [""] * len(failures), True, seconds
        )


class _SampleMemory:
    """Memory for samples and whirl of runs, reused for later runs.

    Parameters
    ----------
    first
        Any of the runs.
    runs
        Largest number of runs.
    """

    def __init__(self, first: PreparedRun, runs: int) -> None:
        # Each channel is contiguous, because metrics process one after the other. Padding between
        # channels keeps them from mapping to the same cache lines.
        steps, channels = first.steps, first.channels
        self._lines = np.empty((runs, len(channels), (steps // 16 + 1) * 16 + 8))
        self._samples = self._lines[:, :, :steps].transpose(0, 2, 1)
        self._x, self._y = (self._lines[:, column_of(axis, channels), :steps] for axis in "xy")
        self._whirl = None if "z" in channels else np.empty((runs, steps))

    def eight(self, place: int) -> LaneSamples:
        """Return the memory for the samples of eight runs, the first of them at ``place``."""
        return LaneSamples.by_channel(self._lines[place : place + LANES])

    def compute_whirl(self, place: int) -> None:
        """Compute the whirl of eight runs from ``place`` on, while the cache has their samples."""
        eight = slice(place, place + LANES)
        if self._whirl is not None:
            with np.errstate(all="ignore"):  # some runs may have diverged
                self._whirl[eight] = whirl_of(self._x[eight], self._y[eight])

    def of(self, runs: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the samples of runs, shape (runs, samples, channels), and their whirl [m].

        Parameters
        ----------
        runs
            Places of the runs, rising.

        Returns
        -------
        tuple[np.ndarray, np.ndarray | None]
            The whirl has shape (runs, samples); it is None for a deck in space.
        """
        # A slice is a view of the samples, while an array of indices would copy them.
        all_first = len(runs) == 0 or len(runs) == runs[-1] + 1
        which = slice(0, len(runs)) if all_first else runs
        return self._samples[which], None if self._whirl is None else self._whirl[which]


def _with_metrics(
    prepared: Sequence[PreparedRun], keys: Sequence[str]
) -> Iterator[tuple[list[int], DoneRuns, dict[str, list[Any]]]]:
    """Run prepared runs in parts that fit into memory, with every step.

    Yields
    ------
    tuple[list[int], DoneRuns, dict[str, list[Any]]]
        The indices of some runs of one group, these runs, and their metrics by key.
    """
    for members in grouped(prepared).values():
        most = _at_once(prepared[members[0]])
        for begin in range(0, len(members), most):
            chosen = members[begin : begin + most]
            done = run_prepared([prepared[i] for i in chosen], every=1)
            yield chosen, done, _of_runs(done.runs, keys)


def run_and_judge(
    prepared: Sequence[PreparedRun],
    every: int,
    keys: Sequence[str],
    progress: CountProgress | None = None,
) -> tuple[DoneRuns, dict[str, list[Any]]]:
    """Run prepared runs, compute their metrics, and keep samples.

    Parameters
    ----------
    prepared, every, progress
        See ``run_prepared``.
    keys
        Keys of the metrics, which are computed from every step.

    Returns
    -------
    tuple[DoneRuns, dict[str, list[Any]]]
        Finished runs; reported metrics of each run by key, None for failed runs.
    """
    runs: list[Any] = [None] * len(prepared)
    metrics: dict[str, list[Any]] = {key: [None] * len(prepared) for key in keys}
    seconds, done, in_lanes = 0.0, 0, 0
    for chosen, part, values in _with_metrics(prepared, keys):
        for place, i in enumerate(chosen):
            run = part.runs[place]
            runs[i] = run._replace(trajectory=run.trajectory.decimated(every))
            for key in keys:
                metrics[key][i] = values[key][place]
        seconds, done = seconds + part.integration_seconds, done + len(chosen)
        in_lanes += part.in_lanes
        if progress is not None:
            progress(done, len(prepared))
    return DoneRuns(tuple(runs), in_lanes, seconds), metrics


def _of_runs(runs: Sequence[BatchRun], keys: Sequence[str]) -> dict[str, list[Any]]:
    """Return metrics of runs of one group from their samples; None for failed runs."""
    complete = [k for k, run in enumerate(runs) if not run.failure]
    columns: dict[str, list[Any]] = {key: [] for key in keys}
    largest = max((runs[k].trajectory.samples.size for k in complete), default=1)
    runs_at_once = max(1, _COPIED_AT_ONCE // largest)
    for begin in range(0, len(complete), runs_at_once):
        some = [runs[k] for k in complete[begin : begin + runs_at_once]]
        paths = [run.trajectory for run in some]
        judged = JudgedRuns([run.scene for run in some], len(paths[0]))
        alone = len(paths) == 1
        samples = paths[0].samples[None] if alone else np.stack([p.samples for p in paths])
        for key, values in _reported(judged, paths[0].channels, keys, samples).items():
            columns[key] += values
    places = np.array(complete, int)
    return {key: _spread(values, places, len(runs)) for key, values in columns.items()}


def _reported(
    runs: JudgedRuns,
    channels: tuple[str, ...],
    keys: Sequence[str],
    samples: np.ndarray,
    whirl: np.ndarray | None = None,
) -> dict[str, list[Any]]:
    """Return metrics of runs by key, in the units of reports; arguments as ``metrics_of_runs``."""
    if not len(runs):
        return {key: [] for key in keys}
    metrics = metrics_of_runs(runs, channels, samples, keys, whirl)
    e = runs.numbers.eccentricity
    return {
        metric.key: metric.all_as_reported(metrics[metric.key], e) for metric in metrics_named(keys)
    }


def _spread(values: list[Any], places: np.ndarray, count: int) -> list[Any]:
    """Return a list of ``count`` entries: ``values`` at the indices ``places``, elsewhere None."""
    if len(values) == count:
        return values
    entries = [None] * count
    for place, value in zip(places.tolist(), values, strict=True):
        entries[place] = value
    return entries


def _at_once(run: PreparedRun) -> int:
    """Return the number of runs whose samples are in memory at a time, a multiple of eight."""
    return max(1, SAMPLES_AT_ONCE // (run.steps * len(run.channels)) // LANES) * LANES

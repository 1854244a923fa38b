"""Many runs of one scene at once, eight side by side."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ab_sim.analysis.metrics.metric import MetricKind, metrics_named
from ab_sim.base.errors import InputError, SceneError, short
from ab_sim.design.batch.judging import judged_parts, run_and_judge
from ab_sim.design.batch.prepared_run import PreparedRun, kernel_stride, steps_of
from ab_sim.design.batch.result import Batch
from ab_sim.design.batch.run_columns import split_of
from ab_sim.design.batch.run_prepared import run_prepared
from ab_sim.design.batch.variations import Variations, by_key, values_of_runs, varied, varied_scene
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.engine.stepping.side_by_side import LANES
from ab_sim.scene import Scene
from ab_sim.scene.load import SceneLike, as_scene

MOST_VALUES = 500_000_000
"""Largest number of sample values, 4 GB; larger requests are refused before anything runs."""


def simulate_batch(
    scene: SceneLike,
    variations: Variations,
    every: int = 1,
    *,
    progress: Callable[[int, int], None] | None = None,
    metrics: Iterable[str] | None = None,
    samples: bool | None = None,
) -> Batch:
    """Run a scene once for each variation, eight at a time if possible.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene that the runs have in common; a requested accuracy is measured with it unchanged.
    variations : sequence of mappings, or mapping of arrays
        One mapping per run from dotted keys to values: SI numbers, or texts with a unit such as
        ``"2 g"``; None removes a key. Or one mapping from dotted keys to lists or arrays with a
        value for each run. Any key may vary.
    every : int, default 1
        Keep every ``every``-th step.
    progress : callable, optional
        Called with the number of finished runs and the total.
    metrics : iterable of str, optional
        Keys of metrics of each run (`ab-sim metrics` lists them), computed from all of its steps.
    samples : bool, optional
        Whether to keep samples; default: only without metrics. Without samples, a run takes memory
        only while it is evaluated.

    Returns
    -------
    Batch
        ``runs`` in the order of the variations, each with its scene, its Trajectory and, if it
        ended early, the reason; ``metrics``, by key an array over the runs; ``failures`` and
        ``aborted``, the reasons of early ends and of aborts. Final metrics of aborted runs have no
        meaning.

    Raises
    ------
    SceneError
        A variation is not a valid scene; the message has its number, from 0.
    InputError
        There is no variation, ``every`` is not a number of steps, a metric does not exist, or the
        samples do not fit into memory.

    Notes
    -----
    Runs that differ in numbers only, not in a count, a choice or a deck's mounts, are computed
    eight side by side with vector instructions. A run with an event in a step (friction, contact, a
    motor) takes that step alone. Runs whose stepper has no lanes (``generalized-alpha``) are
    computed one by one. Samples and metrics are bit-identical to those of a ``Drive`` and of
    ``metrics_of``.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("nsc-case-1", ["duration=0.1"])
    >>> masses = [{"balls.mass": mass} for mass in (0.9e-3, 1.0e-3, 1.1e-3)]
    >>> batch = ab_sim.simulate_batch(scene, masses, every=10)
    >>> [len(run.trajectory) for run in batch.runs]
    [20, 20, 20]
    >>> batch
    <Batch: scene ..., runs 3, in lanes 3, ...>
    >>> judged = ab_sim.simulate_batch(
    ...     scene, {"balls.mass": [0.9e-3, 1.0e-3, 1.1e-3]}, metrics=["final_whirl_over_e"]
    ... )
    >>> judged.metrics["final_whirl_over_e"].round(2), judged.runs
    (array([...]), ())
    """
    scene = as_scene(scene)
    each_variation = values_of_runs(variations)
    keep = metrics is None if samples is None else samples
    keys = [metric.key for metric in metrics_named(metrics or ())]
    _check_every(every, keep)
    if not keep:
        return _metrics_only(scene, each_variation, keys, progress)
    scenes = varied(scene, each_variation)
    # Runs with a requested accuracy have an unknown number of steps until it is resolved.
    _check_room([scene for scene in scenes if scene.accuracy is None], every)
    if scene.accuracy is not None:
        scenes = varied(resolve_accuracy(scene)[0], each_variation)
    prepared = [_prepared(scene, number) for number, scene in enumerate(scenes)]
    _check_room([one.scene for one in prepared], every)
    columns = _empty_columns(keys, len(each_variation))
    if keys:
        done, metrics_of_runs = run_and_judge(prepared, every, keys, progress)
        _fill_in(columns, np.arange(len(each_variation)), metrics_of_runs)
    else:
        done = run_prepared(prepared, every, progress)
    failures = tuple(run.failure for run in done.runs)
    aborted = tuple(run.aborted for run in done.runs)
    return Batch(*done, each_variation, columns, failures, aborted, done.runs[0].scene.name)


def _metrics_only(
    scene: Scene,
    variations: Sequence[Mapping[str, object]],
    keys: Sequence[str],
    progress: Callable[[int, int], None] | None,
) -> Batch:
    """Evaluate runs without keeping their samples."""
    scene, _ = resolve_accuracy(scene)
    count = len(variations)
    split = split_of(scene, by_key(variations))
    alike = np.empty(0, int) if split is None else split.rows
    prepared = {
        number: _prepared(varied_scene(scene, variations[number], number), number)
        for number in np.setdiff1d(np.arange(count), alike).tolist()
    }
    _check_room([scene, *(one.scene for one in prepared.values())], 1, keep=False)
    failures, aborted, columns = [""] * count, [""] * count, _empty_columns(keys, count)
    seconds, done, in_lanes = 0.0, 0, 0
    for part in judged_parts(split, prepared, keys):
        _fill_in(columns, part.runs, part.metrics)
        for run, *whys in zip(part.runs.tolist(), part.failures, part.aborts, strict=True):
            failures[run], aborted[run] = whys
        seconds, done = seconds + part.seconds, done + len(part.runs)
        in_lanes += len(part.runs) if part.in_lanes else 0
        if progress is not None:
            progress(done, count)
    why = tuple(failures), tuple(aborted)
    return Batch((), in_lanes, seconds, variations, columns, *why, scene.name)


def _empty_columns(keys: Sequence[str], runs: int) -> dict[str, np.ndarray]:
    """Return columns of metrics before any run; see ``Batch.metrics``."""
    return {
        metric.key: np.full(runs, np.nan)
        if metric.kind is MetricKind.NUMBER
        else np.full(runs, None, object)
        for metric in metrics_named(keys)
    }


def _fill_in(
    columns: Mapping[str, np.ndarray], runs: np.ndarray, metrics: Mapping[str, Sequence[Any]]
) -> None:
    """Write metrics of some runs into the columns."""
    for key, column in columns.items():
        if column.dtype == float:
            column[runs] = np.array(metrics[key], float)  # NaN for None
        else:
            for run, value in zip(runs.tolist(), metrics[key], strict=True):
                column[run] = value


def _check_every(every: int, keep: bool) -> None:
    if not isinstance(every, int) or every < 1:
        raise InputError(f"every = {short(every)}: must be a whole number, at least 1")
    if every > 1 and not keep:
        raise InputError(
            f"every = {short(every)}: selects the samples to keep, but none are kept; omit it, or "
            "pass samples=True"
        )


def _prepared(scene: Scene, number: int) -> PreparedRun:
    try:
        return PreparedRun(scene)
    except SceneError as error:
        raise SceneError(f"variation {number}: {error}") from error


def _check_room(scenes: Sequence[Scene], every: int, keep: bool = True) -> None:
    fewest = min(map(steps_of, scenes), default=every)
    if every > fewest:
        raise InputError(
            f"every = {short(every)}: must be at most {fewest}, the steps of the shortest run"
        )
    kept = at_work = 0
    for scene in scenes:
        width, steps = 14 + 2 * (scene.balls.count + len(scene.pickups)), steps_of(scene)
        kept += steps // every * width if keep else 0
        most = steps // kernel_stride(scene, every) * width * LANES + 3 * steps
        at_work = max(at_work, most)
    if kept + at_work > MOST_VALUES:
        raise InputError(
            f"{len(scenes)} runs of at most {max(map(steps_of, scenes))} steps: would need "
            f"memory for {kept + at_work:.2g} numbers, at most {MOST_VALUES:.2g} are allowed; keep "
            "fewer samples with a larger every, run fewer at once, or use a longer solver.step"
        )

"""Many runs of one scene at once, eight side by side."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ab_sim.analysis.metrics.metric import MetricKind, metrics_named
from ab_sim.base.errors import InputError, SceneError, short
from ab_sim.base.presentation import Column, Columns, CountProgress, Presented, ends, number
from ab_sim.design.batch.judging import judged_parts, run_and_judge
from ab_sim.design.batch.prepared_run import BatchRun, PreparedRun, steps_of
from ab_sim.design.batch.run_columns import columns_of
from ab_sim.design.batch.run_prepared import kernel_stride, run_prepared
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.engine.stepping.side_by_side import LANES
from ab_sim.scene import Scene
from ab_sim.scene.load import SceneLike, as_scene, changed_scene

Variations = Sequence[Mapping[str, object]] | Mapping[str, Sequence[object] | np.ndarray]
"""Values by dotted key for each run, or values of all runs by dotted key."""


def values_of_runs(variations: Variations) -> Sequence[Mapping[str, object]]:
    """Return the values of each run.

    Raises
    ------
    InputError
        There is no run, or the argument has another form.
    """
    if isinstance(variations, Mapping):
        lengths = {
            len(column) if isinstance(column, list | tuple) or _is_array(column) else 0
            for column in variations.values()
        }
        if len(lengths) == 1 and 0 not in lengths:
            return ByKey(variations)
    elif isinstance(variations, Sequence) and not isinstance(variations, str) and variations:
        return variations
    raise InputError(
        f"variations = {short(variations)}: must be a list with one mapping per run, {{}} for the "
        "scene itself; or a mapping of keys to lists or arrays, all with a value for each run"
    )


def _is_array(column: object) -> bool:
    """Return whether a column is an array with one entry per run."""
    return isinstance(column, np.ndarray) and column.ndim > 0


class ByKey(Sequence[Mapping[str, object]]):
    """Values by key, as a sequence with one mapping per run.

    Parameters
    ----------
    columns
        Values of all runs by dotted key.
    """

    def __init__(self, columns: Mapping[str, Sequence[object] | np.ndarray]) -> None:
        self.columns = dict(columns)
        """Original columns."""

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return ByKey({key: column[index] for key, column in self.columns.items()})
        values = ((key, column[index]) for key, column in self.columns.items())
        # Convert to plain Python types, which scenes accept.
        numpy = np.generic, np.ndarray
        return {key: v.tolist() if isinstance(v, numpy) else v for key, v in values}


def _by_key(variations: Sequence[Mapping[str, object]]) -> dict[str, Any]:
    """Return values of all runs by dotted key, None if missing; empty if keys are not texts."""
    if isinstance(variations, ByKey):
        return variations.columns
    if not all(isinstance(variation, Mapping) for variation in variations):
        return {}
    keys = dict.fromkeys(key for variation in variations for key in variation)
    if not all(isinstance(key, str) for key in keys):
        return {}
    return {key: [variation.get(key) for variation in variations] for key in keys}


def varied(scene: Scene, variations: Sequence[Mapping[str, object]]) -> list[Scene]:
    """Return the scenes of a batch.

    Raises
    ------
    SceneError
        A scene is not valid; the message contains its number, from 0, and its key.
    """
    return [varied_scene(scene, variation, number) for number, variation in enumerate(variations)]


def varied_scene(scene: Scene, variation: Mapping[str, object], number: int) -> Scene:
    """Return the scene of one run.

    Raises
    ------
    SceneError
        See ``varied``.
    """
    return changed_scene(scene, variation, f"variation {number}")


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
    """CPU time that the calling thread spent on the steps of all runs [s].

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
    """Return the last value; NaN if there is none."""
    return float(values[-1]) if len(values) else math.nan


MOST_VALUES = 500_000_000
"""Largest number of sample values, 4 GB; larger requests are refused before anything runs."""


def simulate_batch(
    scene: SceneLike,
    variations: Variations,
    every: int = 1,
    *,
    progress: CountProgress | None = None,
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
    progress: CountProgress | None,
) -> Batch:
    """Evaluate runs without keeping their samples."""
    scene, _ = resolve_accuracy(scene)
    count = len(variations)
    by_column = columns_of(scene, _by_key(variations))
    alike = np.empty(0, int) if by_column is None else by_column.valid
    prepared = {
        number: _prepared(varied_scene(scene, variations[number], number), number)
        for number in np.setdiff1d(np.arange(count), alike).tolist()
    }
    _check_room([scene, *(one.scene for one in prepared.values())], 1, keep=False)
    failures, aborted, columns = [""] * count, [""] * count, _empty_columns(keys, count)
    seconds, done, in_lanes = 0.0, 0, 0
    for part in judged_parts(by_column, prepared, keys):
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
    """Refuse an ``every`` that is no number of steps, or that has no samples to select."""
    if not isinstance(every, int) or every < 1:
        raise InputError(f"every = {short(every)}: must be a whole number, at least 1")
    if every > 1 and not keep:
        raise InputError(
            f"every = {short(every)}: selects the samples to keep, but none are kept; omit it, or "
            "pass samples=True"
        )


def _prepared(scene: Scene, number: int) -> PreparedRun:
    """Return a prepared run; an error contains the number of its variation."""
    try:
        return PreparedRun(scene)
    except SceneError as error:
        raise SceneError(f"variation {number}: {error}") from error


def _check_room(scenes: Sequence[Scene], every: int, keep: bool = True) -> None:
    """Refuse a batch whose samples need too much memory, before anything runs.

    Parameters
    ----------
    scenes
        Scenes of the runs, with known steps.
    every
        Number of steps between kept samples.
    keep
        Whether samples are kept; otherwise only eight runs need memory at a time.
    """
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

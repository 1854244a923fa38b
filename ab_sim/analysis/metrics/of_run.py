"""Computation of the metrics of runs."""

from collections.abc import Callable, Iterable

import numpy as np

from ab_sim.analysis.metrics.declared import Metrics
from ab_sim.analysis.metrics.judging import (
    JudgedRuns,
    SampleBlock,
    SampleBlocks,
    accumulate,
    as_one_block,
    in_blocks,
    passes,
)
from ab_sim.analysis.metrics.metric import metrics_named
from ab_sim.base.errors import InputError
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.load import SceneLike, as_scene
from ab_sim.scene.model import Scene


def metrics_of(
    trajectory: Trajectory, scene: SceneLike, keys: Iterable[str] | None = None
) -> Metrics:
    """Compute metrics of a run, some or all: ``ab-sim metrics`` lists them.

    Quantities that only other metrics need are not computed.

    Parameters
    ----------
    trajectory : Trajectory
        The whole run, from its start to its end; it may be decimated.
    scene : Scene, str or Path
        Scene of the run, or its name or file.
    keys : iterable of str, optional
        Names of the requested metrics; default: all.

    Returns
    -------
    Metrics
        ``metrics["final_whirl_over_e"]`` returns a metric by name, in the unit that ``ab-sim
        metrics`` lists; ``report()`` returns all requested metrics by name as JSON-able values.

    Raises
    ------
    InputError
        A key is unknown (the message names the nearest one), or there are no samples.
    SceneError
        The scene is not valid.

    Notes
    -----
    Displacements are relative to the deck's rest position.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.5"])
    >>> run = ab_sim.Drive(scene).advance(500)
    >>> ab_sim.metrics_of(run, scene, ["final_speed", "settled"]).report()
    {'final_speed': 20.0, 'settled': True}
    """
    if len(trajectory) == 0:
        raise InputError("trajectory: has no samples; metrics need at least one")
    scene = as_scene(scene)
    runs = JudgedRuns([scene], len(trajectory))
    columns = metrics_of_runs(runs, trajectory.channels, trajectory.samples[None], keys)
    return _of_first_run(columns, scene)


def metrics_of_blocks(
    blocks: SampleBlocks, count: int, scene: Scene, keys: Iterable[str] | None = None
) -> Metrics:
    """Compute the metrics of a run that does not fit into memory, in ``passes_of`` passes.

    Parameters
    ----------
    blocks
        Function that starts at the beginning of the run on each call; it yields successive
        trajectories, none of them empty.
    count
        Number of samples, at least 1.
    scene
        Scene of the run.
    keys
        See ``metrics_of``.

    Raises
    ------
    InputError
        See ``metrics_of``.
    """
    runs = JudgedRuns([scene], count)
    return _of_first_run(_computed(lambda: in_blocks(blocks, runs), runs, keys), scene)


def metrics_of_runs(
    runs: JudgedRuns,
    channels: tuple[str, ...],
    samples: np.ndarray,
    keys: Iterable[str] | None = None,
    whirl: np.ndarray | None = None,
) -> dict[str, list[object]]:
    """Compute the metrics of several runs; the values of a run do not depend on the others.

    Parameters
    ----------
    runs
        Data of the runs.
    channels
        Channels of the samples.
    samples
        Samples from the start of each run to its end, shape (runs, samples, channels).
    keys
        See ``metrics_of``.
    whirl
        For planar decks, W [m] at all samples if already computed by ``whirl_of``, shape (runs,
        samples).

    Returns
    -------
    dict[str, list[object]]
        Values of each run by key, whirls in m.

    Raises
    ------
    InputError
        See ``metrics_of``.
    """
    block = as_one_block(channels, samples, runs, whirl)
    return _computed(lambda: [block], runs, keys)


def passes_of(keys: Iterable[str] | None = None) -> int:
    """Return the number of passes of ``metrics_of_blocks`` through a run."""
    return passes(metric.accumulator for metric in metrics_named(keys))


def _computed(
    blocks: Callable[[], Iterable[SampleBlock]], runs: JudgedRuns, keys: Iterable[str] | None
) -> dict[str, list[object]]:
    """Return the values of metrics for each run, by key; see ``metrics_of_runs``."""
    wanted = metrics_named(keys)
    accumulators = accumulate(blocks, runs, [metric.accumulator for metric in wanted])
    return {metric.key: metric.values(accumulators[metric.accumulator]) for metric in wanted}


def _of_first_run(columns: dict[str, list[object]], scene: Scene) -> Metrics:
    """Return the metrics of the first run from the values of all runs by key."""
    values = {key: column[0] for key, column in columns.items()}
    return Metrics(values, scene.rotor.eccentricity)

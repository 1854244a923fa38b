"""Many runs of a scene, of which only some numbers count: shared among processes, and kept."""

import functools
import itertools
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim import Scene, Trajectory, load_scene, simulate_batch
from ab_sim.analysis.metrics import metrics_of
from ab_sim.analysis.result_cache import PointCheckpoint
from ab_sim.base.workers import Workers
from gallery.thesis.drive import BASE, Parameters, Period, Tell, variation_of

EVERY = 10
"""Of the steps that runs are judged by."""
AT_A_TIME = 16
"""Runs that a process is given."""
Judge = Callable[[Scene, Trajectory], list[float | None]]
"""Some numbers of a run; of a module."""


class End(NamedTuple):
    """How a start-up ends."""

    opposite: float | None
    """When both balls first are at -180 deg or beyond [s]."""
    final_whirl: float
    """W/e, root mean square over the last tenth."""
    in_band: float | None
    """From when on W stays within its final band [s]."""
    angle: float
    """Of the balls at the end, their mean, unwrapped [deg]."""


def ends(
    what: str,
    cases: Sequence[tuple[Parameters, Period | None]],
    tell: Tell,
    target: float = 400.0,
    duration: float | None = None,
) -> list[End]:
    """How start-ups end; arguments as of ``start_ups``."""
    variations = [variation_of(*case, target, duration) for case in cases]
    found = many(what, load_scene(BASE), variations, end_of, tell)
    return [End(*one) for one in found]


def end_of(scene: Scene, trajectory: Trajectory) -> list[float | None]:
    """The numbers of ``End``."""
    metrics = metrics_of(trajectory, scene)
    angle = float(np.degrees(np.mean(metrics.final_ball_angles)))
    whirl = metrics.final_whirl / scene.rotor.eccentricity
    return [metrics.first_passage_of_opposite, whirl, metrics.in_band_from, angle]


def many(
    what: str,
    scene: Scene,
    variations: Sequence[Mapping[str, Any]],
    judge: Judge,
    tell: Tell,
) -> list[list[Any]]:
    """Numbers of runs, in the variations' order; what is known is on disk."""
    points = [(k, 0) for k in range(len(variations))]
    numbers = {"variations": list(map(dict, variations)), "every": EVERY}
    with (
        Workers(os.cpu_count() or 1) as workers,
        PointCheckpoint(judge, scene, numbers) as kept,
    ):

        def run(wanted: Sequence[tuple[int, int]]) -> Iterable[Any]:
            chosen = [variations[k] for k, _ in wanted]
            parts = [chosen[k : k + AT_A_TIME] for k in range(0, len(chosen), AT_A_TIME)]
            of_part = functools.partial(_judged, scene, judge)
            return itertools.chain.from_iterable(workers.each(of_part, parts, 1))

        return kept.of(points, run, what, tell)


def _judged(
    scene: Scene, judge: Judge, variations: Sequence[Mapping[str, Any]]
) -> list[list[float | None]]:
    batch = simulate_batch(scene, variations, every=EVERY)
    return [judge(run.scene, run.trajectory) for run in batch.runs]

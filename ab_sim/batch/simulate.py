"""Many runs of one scene at once, eight side by side."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ab_sim.accuracy import resolve_accuracy
from ab_sim.batch.prepared_run import (
    BatchRun,
    PreparedRun,
    kernel_stride,
    steps_of,
)
from ab_sim.batch.run_prepared import run_prepared
from ab_sim.errors import InputError, SceneError
from ab_sim.integrate.side_by_side import LANES
from ab_sim.presentation import Column, Columns, Presented, ends, number
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene

MOST_VALUES = 500_000_000
"""4 GB of samples; more are refused before anything runs, but for accuracies to be measured."""


@dataclass(frozen=True, repr=False)
class Batch(Presented):
    """Runs in the order of their variations; see ``ab_sim.simulate_batch``."""

    _picture = "batch"

    runs: tuple[BatchRun, ...]
    side_by_side: int
    """Number of runs that ran in lanes; the others ran one by one."""
    integration_seconds: float
    """CPU time of this thread for taking the steps, all runs together [s]. Of runs that go one by
    one, a kernel for a further kind of the profile's segments is made in it, too."""
    variations: tuple[Mapping[str, object], ...] = ()
    """What is varied, values by dotted key for each run."""

    def _facts(self) -> dict[str, str]:
        failed = sum(bool(run.failure) for run in self.runs)
        facts = {
            "scene": self.runs[0].scene.name,
            "runs": str(len(self.runs)),
            "side by side": str(self.side_by_side),
        }
        kept = [run.trajectory for run in self.runs if len(run.trajectory)]
        if kept:
            last = [float(path.whirl[-1]) for path in kept]
            facts["until"] = number(max(path["time"][-1] for path in kept), "s")
            facts["W at the end"] = ends(min(last), max(last), "m")
        return facts | ({"diverged": str(failed)} if failed else {})

    def _columns(self) -> Columns:
        keys = dict.fromkeys(key for variation in self.variations for key in variation)
        varied = {
            key: Column(None, [variation.get(key) for variation in self.variations]) for key in keys
        }
        paths = [run.trajectory for run in self.runs]
        whirls = [path.whirl for path in paths]
        return varied | {
            "samples": Column("1", [len(path) for path in paths]),
            "end": Column("s", [_last(path["time"]) for path in paths]),
            "speed": Column("rad/s", [_last(path["speed"]) for path in paths]),
            "peak_whirl": Column("m", [float(whirl.max(initial=0.0)) for whirl in whirls]),
            "whirl": Column("m", [_last(whirl) for whirl in whirls]),
            "failure": Column(None, [run.failure for run in self.runs]),
        }


def _last(values: np.ndarray) -> float:
    return float(values[-1]) if len(values) else math.nan


def simulate_batch(
    scene: Scene,
    variations: Sequence[Mapping[str, object]],
    every: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Batch:
    """Run a scene's profile once for each variation, for the scene's duration.

    Runs that differ in numbers only, not in a count, a choice or a deck's mounts, go eight side by
    side, with vector instructions. Runs of scenes with events (friction, contact, a motor), or
    whose stepper takes no lanes (``generalized-alpha``; ``collocation``, whose own are for the
    instants of one run), go one by one, and give what a Drive gives to the bit.

    Args:
        scene: what the runs have in common; an accuracy that it asks for is measured with it as it
            is, without variations.
        variations: for each run, values by dotted key, e.g. ``{"balls.mass": 0.002,
            "effects.viscous_drag.coefficient": 2.0}``, SI or a text with a unit, ``"2 g"``; None
            removes a key. Any key may vary.
        every: keep each so-many-th step.
        progress: called with (runs done, runs).

    Raises:
        SceneError: a variation is not a valid scene, or cannot be run with its solver; names it by
            its number, from 0.
        InputError: no variations, ``every`` is no number of steps, or more samples than there is
            room for.
    """
    if not isinstance(every, int) or every < 1:
        raise InputError(f"every = {every!r}: must be a whole number, at least 1")
    if not isinstance(variations, Sequence) or isinstance(variations, str) or not variations:
        raise InputError(
            f"variations = {variations!r}: must be a list with one mapping per run, {{}} for the "
            "scene itself"
        )
    scenes = varied(scene, variations)
    # Where an accuracy is to be measured first, steps are not known yet.
    _check_room([scene for scene in scenes if scene.accuracy is None], every)
    if scene.accuracy is not None:
        scenes = varied(resolve_accuracy(scene)[0], variations)
    prepared = [_prepared(scene, number) for number, scene in enumerate(scenes)]
    _check_room([one.scene for one in prepared], every)
    done = run_prepared(prepared, every, progress)
    return Batch(*done, tuple(dict(each) for each in variations))


def varied(scene: Scene, variations: Sequence[Mapping[str, object]]) -> list[Scene]:
    """The scenes of a batch.

    Raises:
        SceneError: one of them is not valid; names it by its number, from 0, and by its key.
    """
    return [
        changed_scene(scene, variation, f"variation {number}")
        for number, variation in enumerate(variations)
    ]


def _prepared(scene: Scene, number: int) -> PreparedRun:
    try:
        return PreparedRun(scene)
    except SceneError as error:
        raise SceneError(f"variation {number}: {error}") from error


def _check_room(scenes: list[Scene], every: int) -> None:
    fewest = min(map(steps_of, scenes), default=every)
    if every > fewest:
        raise InputError(
            f"every = {every!r}: must be at most {fewest}, the steps of the shortest run"
        )
    kept = at_work = 0
    for scene in scenes:
        width, steps = 14 + 2 * (scene.balls.count + len(scene.sensors)), steps_of(scene)
        kept += steps // every * width
        most = steps // kernel_stride(scene, every) * width * LANES + 3 * steps
        at_work = max(at_work, most)
    if kept + at_work > MOST_VALUES:
        raise InputError(
            f"{len(scenes)} runs of at most {max(map(steps_of, scenes))} steps: would need room "
            f"for {kept + at_work:.2g} numbers, at most {MOST_VALUES:.2g} are allowed; keep fewer "
            "with a larger every, run fewer at once, or make solver.step longer"
        )

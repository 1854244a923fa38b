"""Many runs of one scene at once, eight side by side."""

import functools
import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.accuracy import resolve_accuracy
from ab_sim.batch.lanes import merged
from ab_sim.batch.prepared_run import (
    BatchRun,
    PreparedRun,
    StepPlanKey,
    kernel_stride,
    sample_buffer_for,
    steps_of,
)
from ab_sim.batch.sample_buffer import SampleBuffer
from ab_sim.batch.sequential import SequentialRuns, run_one_by_one
from ab_sim.compiling import compiled
from ab_sim.dynamics.assemble import start_discrete_state, start_state, state_bounds
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.system import TURNS
from ab_sim.errors import InputError, SceneError
from ab_sim.integrate.side_by_side import LANES, LanePlan, LaneRuns, advance_side_by_side, stacked
from ab_sim.kernels.code import code_of
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


class DoneRuns(NamedTuple):
    """What became of many runs; see ``Batch``."""

    runs: tuple[BatchRun, ...]
    side_by_side: int
    integration_seconds: float


def run_prepared(
    prepared: Sequence[PreparedRun],
    every: int,
    progress: Callable[[int, int], None] | None = None,
) -> DoneRuns:
    """Run them, those that are alike side by side where that can be.

    Args:
        prepared: in the order of the results.
        every, progress: see ``simulate_batch``.
    """
    runs: list[BatchRun | None] = [None] * len(prepared)
    seconds, done, lanes_used = 0.0, 0, 0
    for members in _grouped(prepared).values():
        first = prepared[members[0]]
        in_lanes = first.fits_lane
        sample_buffer = sample_buffer_for([prepared[i] for i in members], every)
        run_sequentially = (
            SequentialRuns(first, sample_buffer).run
            if first.takes_collocation_steps
            else run_one_by_one
        )
        width = LANES if in_lanes else 1
        for begin in range(0, len(members), width):
            chosen = members[begin : begin + width]
            these = [prepared[i] for i in chosen]
            taken = _side_by_side(these, every, sample_buffer) if in_lanes else None
            lanes_used += len(chosen) if taken else 0
            results, spent = taken or run_sequentially(these, every)
            for i, result in zip(chosen, results, strict=True):
                runs[i] = result
            seconds, done = seconds + spent, done + len(chosen)
            if progress is not None:
                progress(done, len(prepared))
    return DoneRuns(tuple(run for run in runs if run is not None), lanes_used, seconds)


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


def _grouped(prepared: Sequence[PreparedRun]) -> dict[Any, list[int]]:
    groups: dict[Any, list[int]] = {}
    for i, one in enumerate(prepared):
        groups.setdefault(one.group_key, []).append(i)
    return groups


def _side_by_side(
    members: list[PreparedRun],
    every: int,
    sample_buffer: SampleBuffer,
) -> tuple[list[BatchRun], float]:
    """Run up to eight runs in lanes; runs, and CPU time [s].

    Args:
        members: up to eight runs of one group.
        every: every how many-th step is kept.
        sample_buffer: for their samples.
    """
    # Lanes without a run of their own repeat the last one.
    lanes = [*members, *itertools.repeat(members[-1], LANES - len(members))]
    first = members[0]
    step, steps = first.scene.solver.step, first.steps
    kind, plan = _plan(tuple(lane.step_plan_key for lane in lanes), steps)
    in_kernel = kernel_stride(first.scene, every)
    runs = _runs(lanes, kind, in_kernel)
    samples = sample_buffer.take(LANES)
    kernel = compiled(advance_side_by_side)
    begin = time.thread_time()
    kernel(runs, plan, samples)
    seconds = time.thread_time() - begin
    results = []
    for lane, member in enumerate(members):
        sound, failure = int(runs.sound[1, lane]), ""
        if sound < steps:
            failure = (
                f"went beyond all bounds at t = {(sound + 1) * step:.9g} s; a Drive of this scene "
                "says what did, and why"
            )
        kept = samples[lane, : sound // in_kernel]
        taken = member.trajectory(kept, every // in_kernel)
        results.append(BatchRun(member.scene, taken, failure))
    return results, seconds


@functools.lru_cache(maxsize=8)
def _plan(keys: tuple[StepPlanKey, ...], steps: int) -> tuple[type, LanePlan]:
    """The merged plan of eight runs, made once for runs whose profiles are equal."""
    return merged([key.step_ranges(steps) for key in keys], keys[0].grid.step)


def _runs(lanes: list[PreparedRun], kind: type, every: int) -> LaneRuns:
    """Work arrays of eight runs of one group, at their start."""
    first = lanes[0]
    code, layout, n = code_of(first.system, kind), layout_of(first.system), len(first.system.balls)
    step, size = first.scene.solver.step, layout.size
    column = len(code.emission.roots["sample"])
    tableau = first.stepper.weights
    discrete_state = [start_discrete_state(lane.scene, lane.system) for lane in lanes]
    sound = np.zeros((2, LANES))
    sound[0] = 1.0
    room = np.zeros((size, LANES))
    return LaneRuns(
        prepare=code.address("prepare", LANES),
        slope=code.address("slope", LANES),
        step=code.step(tableau.a, tableau.b, tableau.c, LANES),
        finish=code.address("finish", LANES),
        c=stacked([code.constants(lane.system) for lane in lanes]),
        b=np.zeros(code.branches()),
        place=code.layout.place,
        first_angle=layout.angles.start,
        balls=n,
        ball_column=column,
        step_length=step,
        every=every,
        bounds=stacked([state_bounds(lane.system, step) for lane in lanes]),
        state=stacked([start_state(lane.scene, lane.system) for lane in lanes]),
        turns=stacked([each[:n, TURNS] for each in discrete_state]),
        sound=sound,
        slopes=room,
        trial=room.copy(),
        row=np.zeros((column + 2 * n, LANES)),
        times=np.zeros((2, LANES)),
    )

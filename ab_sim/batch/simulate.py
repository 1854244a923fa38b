"""Many runs of one scene at once, eight side by side."""

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.accuracy import resolve_accuracy
from ab_sim.batch.plan import merged
from ab_sim.drive import Drive
from ab_sim.drive.rows import RowReader
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.assemble import start_modes, start_state, state_bounds, system_of
from ab_sim.dynamics.numbers.lanes import LANES, leaves, pattern
from ab_sim.dynamics.system import MODES, carrier_unknowns, has_events
from ab_sim.errors import DivergedError, InputError
from ab_sim.integrate.choose import choose_stepper
from ab_sim.integrate.samples import ANGLE, STEP, TIME, row_width
from ab_sim.integrate.side_by_side import Runs, advance_side_by_side, lanes_can
from ab_sim.integrate.stepper import Stepper
from ab_sim.integrate.workspace import aligned, room
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene
from ab_sim.spindle import SpeedProfile
from ab_sim.spindle.stretches import Grid, stretches

MOST_VALUES = 500_000_000
"""4 GB of samples; more are refused before anything runs, but for accuracies to be measured."""


class BatchRun(NamedTuple):
    """One of the runs."""

    scene: Scene
    trajectory: Trajectory
    """Every ``every``-th step; up to the last sound one, if the run diverged."""
    failure: str
    """Why it ended early; empty if it did not."""


class Batch(NamedTuple):
    """Runs in the order of their variations."""

    runs: tuple[BatchRun, ...]
    side_by_side: int
    """How many of them ran in lanes; the others, one by one."""
    integration_seconds: float
    """CPU time of this thread for taking the steps, all runs together [s]; the first ones of their
    kind compile a kernel, or load it."""


def simulate_batch(
    scene: Scene,
    variations: Sequence[Mapping[str, Any]],
    every: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Batch:
    """Run a scene's profile once for each variation, for the scene's duration.

    Runs that differ in numbers only, not in a count, a choice or a deck's mounts, go eight side by
    side, with vector instructions, and give what a Drive gives to rounding; in the last digits they
    may depend on what goes beside them. Runs of scenes with events (friction, contact, a motor),
    with an effect that branches on its numbers (see dynamics.effects), or whose stepper solves for
    the drag, go one by one.

    Args:
        scene: what the runs have in common; an accuracy that it asks for is measured with it as it
            is, without variations.
        variations: for each run, values by dotted key, e.g. ``{"balls.mass": 0.002,
            "effects.viscous_drag.coefficient": 2.0}``; None removes a key. Any key may vary.
        every: keep each so-many-th step.
        progress: called with (runs done, runs).

    Raises:
        SceneError: a variation is not a valid scene; names it by its number, from 0.
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
    prepared = [_Prepared(scene) for scene in scenes]
    _check_room([one.scene for one in prepared], every)
    runs: list[BatchRun | None] = [None] * len(scenes)
    seconds, done, lanes_used = 0.0, 0, 0
    for members in _alike(prepared).values():
        fit = prepared[members[0]].fits_a_lane
        width = LANES if fit else 1
        for begin in range(0, len(members), width):
            chosen = members[begin : begin + width]
            these = [prepared[i] for i in chosen]
            taken = _side_by_side(these, every) if fit else None
            lanes_used += len(chosen) if taken else 0
            results, spent = taken or _one_by_one(these, every)
            for i, result in zip(chosen, results, strict=True):
                runs[i] = result
            seconds, done = seconds + spent, done + len(chosen)
            if progress is not None:
                progress(done, len(scenes))
    return Batch(tuple(run for run in runs if run is not None), lanes_used, seconds)


def varied(scene: Scene, variations: Sequence[Mapping[str, Any]]) -> list[Scene]:
    """The scenes of a batch.

    Raises:
        SceneError: one of them is not valid; names it by its number, from 0, and by its key.
    """
    return [
        changed_scene(scene, variation, f"variation {number}")
        for number, variation in enumerate(variations)
    ]


def _steps(scene: Scene) -> int:
    return max(1, math.ceil(scene.duration / scene.solver.step - 1e-9))


def _kept_at_first(scene: Scene, every: int) -> int:
    """Each so-manieth step comes out of the kernel: an accelerometer's filter takes all of them."""
    return 1 if scene.sensors else every


class _Prepared:
    """A scene with what its run needs."""

    def __init__(self, scene: Scene) -> None:
        self.scene, _ = resolve_accuracy(scene)
        self.system = system_of(self.scene)
        choice = choose_stepper(self.scene, self.system)
        self.stepper, self.grid = choice.stepper, Grid(self.scene.solver.step, choice.cycle)
        self.steps = _steps(self.scene)
        events = has_events(self.system.effects)
        self.fits_a_lane = self.stepper.takes_lanes and not events

    @property
    def likeness(self) -> Any:
        """Runs in which this is the same go side by side."""
        names = tuple(self.scene.effects), tuple(self.scene.sensors)
        constants = pattern((self.system.carrier, self.system.effects))
        solver = self.stepper.name, self.scene.solver.step
        return names, constants, self.scene.balls.count, solver, self.steps


def _check_room(scenes: list[Scene], every: int) -> None:
    fewest = min(map(_steps, scenes), default=every)
    if every > fewest:
        raise InputError(
            f"every = {every!r}: must be at most {fewest}, the steps of the shortest run"
        )
    kept = at_work = 0
    for scene in scenes:
        width, steps = 14 + 2 * (scene.balls.count + len(scene.sensors)), _steps(scene)
        kept += steps // every * width
        most = steps // _kept_at_first(scene, every) * width * LANES + 3 * steps
        at_work = max(at_work, most)
    if kept + at_work > MOST_VALUES:
        raise InputError(
            f"{len(scenes)} runs of at most {max(map(_steps, scenes))} steps: would need room for "
            f"{kept + at_work:.2g} numbers, at most {MOST_VALUES:.2g} are allowed; keep fewer "
            "with a larger every, run fewer at once, or make solver.step longer"
        )


def _alike(prepared: list[_Prepared]) -> dict[Any, list[int]]:
    groups: dict[Any, list[int]] = {}
    for i, one in enumerate(prepared):
        groups.setdefault(one.likeness, []).append(i)
    return groups


def _one_by_one(members: list[_Prepared], every: int) -> tuple[list[BatchRun], float]:
    runs, seconds = [], 0.0
    for member in members:
        drive, failure = Drive(member.scene), ""
        begin = time.thread_time()
        try:
            taken = drive.advance(member.steps, every)
        except DivergedError as error:
            # Once more, up to where it was sound.
            failure, sound = str(error), drive.steps
            drive.reset()
            taken = drive.advance(sound, every)
        seconds += time.thread_time() - begin
        runs.append(BatchRun(member.scene, taken, failure))
    return runs, seconds


def _side_by_side(members: list[_Prepared], every: int) -> tuple[list[BatchRun], float] | None:
    """Runs and CPU time; None if lanes cannot do what an effect does."""
    # Lanes without a run of their own repeat the last one.
    lanes = [*members, *itertools.repeat(members[-1], LANES - len(members))]
    first, stepper = members[0], members[0].stepper
    step, steps = first.scene.solver.step, first.steps
    ways = [
        list(stretches(SpeedProfile.of_scene(lane.scene), lane.grid, 0, steps)) for lane in lanes
    ]
    place, plan = merged(ways, step)
    constants = (
        _stacked([leaves((lane.system.carrier, lane.system.effects)) for lane in lanes]),
        _stacked([lane.system.balls for lane in lanes]),
        _stacked([state_bounds(lane.system, step) for lane in lanes]),
    )
    in_kernel = _kept_at_first(first.scene, every)
    runs = _empty_runs(lanes, stepper, steps // in_kernel)
    clock = step, in_kernel
    arguments = first.system, place, stepper.weights, constants, plan, clock, runs
    if not lanes_can(*arguments):
        return None
    begin = time.thread_time()
    advance_side_by_side(*arguments)
    seconds = time.thread_time() - begin
    results = []
    for lane, member in enumerate(members):
        sound, failure = int(runs.sound[1, lane]), ""
        if sound < steps:
            failure = (
                f"went beyond all bounds at t = {(sound + 1) * step:.9g} s; a Drive of this scene "
                "says what did, and why"
            )
        rows = runs.rows[: sound // in_kernel, :, lane]
        reader = RowReader(member.scene, member.system)
        samples = np.empty((len(rows), len(reader.channels)))
        samples[:, STEP] = in_kernel * np.arange(1, 1 + len(rows))
        samples[:, TIME] = samples[:, STEP] * step
        samples[:, ANGLE : ANGLE + rows.shape[1]] = rows
        whole = reader.trajectory(samples)
        results.append(BatchRun(member.scene, whole.thinned(every // in_kernel), failure))
    return results, seconds


def _empty_runs(lanes: list[_Prepared], stepper: Stepper, samples: int) -> Runs:
    n = lanes[0].scene.balls.count
    states = [start_state(lane.scene, lane.system) for lane in lanes]
    size = len(states[0])
    modes = aligned((n + 1, MODES, LANES))
    modes[:] = np.stack([start_modes(lane.scene, lane.system) for lane in lanes], axis=-1)
    sound = aligned((2, LANES))
    sound[0] = 1.0
    return Runs(
        state=_stacked(states),
        modes=modes,
        sound=sound,
        rows=aligned((samples, row_width(lanes[0].system), LANES)),
        slopes=aligned((stepper.slopes, size, LANES)),
        trial=aligned((size, LANES)),
        room=room(carrier_unknowns(lanes[0].system.carrier) + 1, n, 1, LANES),
    )


def _stacked(values: Sequence[Any]) -> np.ndarray:
    """Values of each lane, stacked along a last axis."""
    stacked = np.stack([np.asarray(value, float) for value in values], axis=-1)
    array = aligned(stacked.shape)
    array[:] = stacked
    return array

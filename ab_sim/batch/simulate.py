"""Many runs of one scene at once, eight side by side."""

import copy
import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.batch.plan import merged
from ab_sim.drive import Drive, priced
from ab_sim.dynamics.assemble import start_modes, start_state, state_bounds, system_of
from ab_sim.dynamics.lanes import LANES, leaves
from ab_sim.dynamics.scratch import WIDTH
from ab_sim.dynamics.system import MODES, has_events
from ab_sim.errors import DivergedError, InputError, SceneError
from ab_sim.integrate.choose import choose_stepper
from ab_sim.integrate.side_by_side import Runs, advance_side_by_side
from ab_sim.integrate.tableau import Tableau
from ab_sim.integrate.workspace import aligned
from ab_sim.rows import BEYOND_STATES, Rows, follow
from ab_sim.scene import Scene, check_scene
from ab_sim.spindle import SpeedProfile
from ab_sim.spindle.stretches import stretches
from ab_sim.trajectory import Trajectory

MOST_VALUES = 500_000_000
"""4 GB of samples; more are refused before anything runs."""


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
    """CPU time of this thread in the compiled loops, all runs together [s]."""


def simulate_batch(
    scene: Scene,
    variations: Sequence[Mapping[str, Any]],
    every: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Batch:
    """Run a scene's profile once for each variation, for the scene's duration.

    Runs that differ in numbers only go eight side by side, with vector instructions, and give
    what a Drive gives to rounding. Runs of scenes with events (friction, contact, a motor), or
    whose stepper solves for the drag, go one by one.

    Args:
        scene: what the runs have in common; an accuracy that it asks for is measured with it as it
            is, without variations.
        variations: for each run, values by dotted key, e.g. ``{"balls.mass": 0.002,
            "effects.viscous_drag.coefficient": 2.0}``; any key of a scene may vary.
        every: keep each so-many-th step.
        progress: called with (runs done, runs).

    Raises:
        SceneError: a variation is not a valid scene; names it by its place, from 0.
        InputError: no variations, or more samples than there is room for.
    """
    if every < 1:
        raise InputError(f"every = {every}: must be at least 1")
    if not variations:
        raise InputError("variations: are none; give one mapping per run, {} for the scene itself")
    scene, _ = priced(scene)
    scenes = varied(scene, variations)
    _check_room(scenes, every)
    prepared = [_Prepared(scene) for scene in scenes]
    runs: list[BatchRun | None] = [None] * len(scenes)
    seconds, done, lanes_used = 0.0, 0, 0
    for members in _alike(prepared).values():
        side_by_side = prepared[members[0]].fits_a_lane
        width = LANES if side_by_side else 1
        for begin in range(0, len(members), width):
            chosen = members[begin : begin + width]
            simulate = _side_by_side if side_by_side else _one_by_one
            results, spent = simulate([prepared[i] for i in chosen], every)
            for i, result in zip(chosen, results, strict=True):
                runs[i] = result
            seconds, done = seconds + spent, done + len(chosen)
            lanes_used += len(chosen) if side_by_side else 0
            if progress is not None:
                progress(done, len(scenes))
    return Batch(tuple(run for run in runs if run is not None), lanes_used, seconds)


def varied(scene: Scene, variations: Sequence[Mapping[str, Any]]) -> list[Scene]:
    """The scenes of a batch.

    Raises:
        SceneError: one of them is not valid; names it by its place, from 0, and by its key.
    """
    common = scene.as_mapping()
    scenes = []
    for place, variation in enumerate(variations):
        raw = copy.deepcopy(common)
        for key, value in variation.items():
            _put(raw, key, value, f"variation {place}")
        scenes.append(check_scene(raw, f"variation {place}"))
    return scenes


def _put(raw: dict[str, Any], key: str, value: Any, origin: str) -> None:
    *sections, last = key.split(".")
    inside = raw
    for section in sections:
        inside = inside.setdefault(section, {})
        if not isinstance(inside, dict):
            raise SceneError(f"{origin}: {key}: {section} is a value, it has no keys")
    inside[last] = value


def _check_room(scenes: list[Scene], every: int) -> None:
    values = 0.0
    for scene in scenes:
        values += scene.duration / scene.solver.step / every * (14 + 2 * scene.balls.count)
    if values > MOST_VALUES:
        raise InputError(
            f"{len(scenes)} runs: would keep {values:.2g} numbers, at most {MOST_VALUES:.2g} are "
            f"allowed; keep fewer with every = {int(every * values / MOST_VALUES) + 1} or more, "
            "or run fewer at once"
        )


class _Prepared:
    """A scene with what its run needs."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.system = system_of(scene)
        self.stepper = choose_stepper(scene, self.system).stepper
        self.steps = round(scene.duration / scene.solver.step)
        events = has_events(self.system.effects)
        self.fits_a_lane = isinstance(self.stepper, Tableau) and not events

    @property
    def likeness(self) -> Any:
        """Runs in which this is the same go side by side."""
        kinds = tuple(type(effect) for effect in self.system.effects)
        return kinds, self.scene.balls.count, self.stepper.name, self.scene.solver.step, self.steps


def _alike(prepared: list[_Prepared]) -> dict[Any, list[int]]:
    groups: dict[Any, list[int]] = {}
    for i, one in enumerate(prepared):
        groups.setdefault(one.likeness, []).append(i)
    return groups


def _one_by_one(members: list[_Prepared], every: int) -> tuple[list[BatchRun], float]:
    runs, begin = [], time.thread_time()
    for member in members:
        drive, failure = Drive(member.scene), ""
        parts: list[Trajectory] = []
        while drive.steps < member.steps and not failure:
            try:
                parts.append(drive.advance(min(1000, member.steps - drive.steps)))
            except DivergedError as error:
                failure = str(error)
        whole = Trajectory.join(parts) if parts else drive.advance(0)
        runs.append(BatchRun(member.scene, _thinned(whole, every), failure))
    return runs, time.thread_time() - begin


def _thinned(trajectory: Trajectory, every: int) -> Trajectory:
    return Trajectory(trajectory.channels, trajectory.samples[every - 1 :: every])


def _side_by_side(members: list[_Prepared], every: int) -> tuple[list[BatchRun], float]:
    # Lanes without a run of their own repeat the last one.
    lanes = [*members, *itertools.repeat(members[-1], LANES - len(members))]
    first, tableau = members[0], members[0].stepper
    assert isinstance(tableau, Tableau)
    step, steps = first.scene.solver.step, first.steps
    profiles = [SpeedProfile.of_scene(lane.scene) for lane in lanes]
    ways = [list(stretches(profile, step, 0, steps)) for profile in profiles]
    place, plan = merged(ways, step)
    constants = (
        _stacked([leaves((lane.system.body, lane.system.effects)) for lane in lanes]),
        _stacked([lane.system.balls for lane in lanes]),
        _stacked([state_bounds(lane.system, step) for lane in lanes]),
    )
    # An accelerometer's filter takes every sample.
    in_kernel = 1 if "accelerometer" in first.scene.effects else every
    runs = _empty_runs(lanes, tableau, steps // in_kernel)
    begin = time.thread_time()
    advance_side_by_side(
        first.system, place, tableau.weights, constants, plan, (step, in_kernel), runs
    )
    seconds = time.thread_time() - begin
    results = []
    for lane, member in enumerate(members):
        spindle = np.empty((steps, 3))
        for stretch in ways[lane]:
            at = slice(stretch.first, stretch.first + max(stretch.steps, 1))
            follow(stretch, step, spindle[at, :2])
        spindle[:, 2] = spindle[:, 1]
        sound, failure = int(runs.sound[1, lane]), ""
        if sound < steps:
            failure = (
                f"went beyond all bounds at t = {(sound + 1) * step:.9g} s; a Drive of this scene "
                "says what did, and why"
            )
        kept = slice(in_kernel - 1, sound, in_kernel)
        rows = np.ascontiguousarray(runs.rows[: sound // in_kernel, :, lane])
        reader = Rows(member.scene, member.system.effects)
        whole = reader.trajectory(1 + np.arange(steps)[kept], rows, spindle[kept])
        results.append(BatchRun(member.scene, _thinned(whole, every // in_kernel), failure))
    return results, seconds


def _empty_runs(lanes: list[_Prepared], tableau: Tableau, samples: int) -> Runs:
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
        rows=aligned((samples, size + BEYOND_STATES, LANES)),
        slopes=aligned((tableau.stages, size, LANES)),
        trial=aligned((size, LANES)),
        scratch=aligned((n, WIDTH, LANES)),
    )


def _stacked(values: Sequence[Any]) -> np.ndarray:
    """Values of each lane, stacked along a last axis."""
    stacked = np.stack([np.asarray(value, float) for value in values], axis=-1)
    array = aligned(stacked.shape)
    array[:] = stacked
    return array

"""Runs one after the other."""

import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from ab_sim.batch.prepared import BatchRun, Prepared, kept_at_first, way_along
from ab_sim.batch.sample_room import SampleRoom
from ab_sim.drive import Drive
from ab_sim.drive.way import Way
from ab_sim.dynamics.assemble import place_along, start_modes, start_state, state_bounds
from ab_sim.dynamics.layout import equation_count
from ab_sim.errors import DivergedError
from ab_sim.integrate.fixed_step import Run, stepping
from ab_sim.integrate.kept import Kept
from ab_sim.integrate.linear_motion import put_own_motion
from ab_sim.integrate.response_tables import doubt
from ab_sim.integrate.workspace import aligned, workspace
from ab_sim.spindle.profile import Segment

_AT_ONCE = 10_000
"""Steps whose samples are in memory at a time where they are thinned."""


def one_by_one(members: Sequence[Prepared], every: int) -> tuple[list[BatchRun], float]:
    """A Drive for each; runs and CPU time [s]. Each ``every``-th step is kept."""
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


class InTurn:
    """Runs of one likeness, with a stepper that takes spans, and without events.

    They have in common what a Drive makes for itself, and what the stepper keeps as long as it
    serves: tables of responses, which one run takes over from another where they are the same.

    Args:
        first: one of them.
        room: for what comes out of the kernel.
    """

    def __init__(self, first: Prepared, room: SampleRoom) -> None:
        self._step, self._stepper, self._room = first.scene.solver.step, first.stepper, room
        bounds = state_bounds(first.system, self._step / self._stepper.parts)
        self._work = workspace(first.system, self._stepper, bounds)
        self._state = aligned(bounds.shape)
        self._modes = start_modes(first.scene, first.system)
        self._rows = np.empty((min(first.steps, _AT_ONCE), len(first.channels)))
        self._kernels: dict[type[Segment], tuple[Kept, Callable[..., int]]] = {}

    def run(self, members: Sequence[Prepared], every: int) -> tuple[list[BatchRun], float]:
        """As ``one_by_one``."""
        runs, seconds = [], 0.0
        for member in members:
            in_kernel, samples = kept_at_first(member.scene, every), self._room.take(1)[0]
            way = way_along(member.course)
            self._to_start(member)
            self._make_kernels(member, way)
            begin = time.thread_time()
            sound = self._take(way, member.steps, in_kernel, samples)
            spent = time.thread_time() - begin
            if sound:
                taken = member.trajectory(samples, every // in_kernel)
                runs.append(BatchRun(member.scene, taken, ""))
            else:
                # A Drive says what went wrong, and where.
                diverged, spent = one_by_one([member], every)
                runs += diverged
            seconds += spent
        return runs, seconds

    def _to_start(self, member: Prepared) -> None:
        put_own_motion(member.system, self._stepper, self._work.tables)
        doubt(self._work.tables, equation_count(member.system))
        self._state[:] = start_state(member.scene, member.system)
        self._modes[:] = start_modes(member.scene, member.system)
        self._work.smooth[0] = math.nan
        for kept, _ in self._kernels.values():
            kept.begin_with(member.system)

    def _take(self, way: Way, steps: int, every: int, samples: np.ndarray) -> bool:
        """Fill in each so-many-th of a run's samples; whether all of them were sound."""
        if every == 1:
            return self._advance(way, 0, samples)
        for done in range(0, steps, len(self._rows)):
            rows = self._rows[: steps - done]
            if not self._advance(way, done, rows):
                return False
            chosen = rows[(-1 - done) % every :: every]
            samples[done // every :][: len(chosen)] = chosen
        return True

    def _advance(self, way: Way, first: int, samples: np.ndarray) -> bool:
        """Fill in samples, ``first`` steps having been taken before; whether all were sound."""
        return way.walk(self._kernel, first, len(samples), math.nan, samples) >= 0

    def _kernel(self, kind: type[Segment]) -> Callable[..., int]:
        return self._kernels[kind][1]

    def _make_kernels(self, member: Prepared, way: Way) -> None:
        for kind in way.kinds:
            if kind not in self._kernels:
                fixed = member.system, place_along(kind), self._stepper.weights, self._step
                kept = Kept(Run(*fixed, self._state, self._modes, self._work, 0))
                self._kernels[kind] = kept, stepping(kept)

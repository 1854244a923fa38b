"""Runs one after the other."""

import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from ab_sim.batch.prepared import BatchRun, Prepared, kept_at_first, way_along
from ab_sim.drive import Drive
from ab_sim.dynamics.assemble import place_along, start_modes, start_state, state_bounds
from ab_sim.errors import DivergedError
from ab_sim.integrate.fixed_step import Run, stepping
from ab_sim.integrate.kept import Kept
from ab_sim.integrate.response_tables import doubt
from ab_sim.integrate.workspace import aligned, workspace
from ab_sim.spindle.profile import Segment

_AT_ONCE = 10_000
"""Steps whose samples are in memory before they are thinned."""


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
    """

    def __init__(self, first: Prepared) -> None:
        self._step, self._stepper = first.scene.solver.step, first.stepper
        bounds = state_bounds(first.system, self._step / self._stepper.parts)
        self._work = workspace(first.system, self._stepper, bounds)
        self._state = aligned(bounds.shape)
        self._modes = start_modes(first.scene, first.system)
        self._kernels: dict[type[Segment], tuple[Kept, Callable[..., int]]] = {}

    def run(self, members: Sequence[Prepared], every: int) -> tuple[list[BatchRun], float]:
        """As ``one_by_one``."""
        runs, seconds = [], 0.0
        for member in members:
            in_kernel = kept_at_first(member.scene, every)
            samples, spent = self._samples(member, in_kernel)
            if len(samples) == member.steps // in_kernel:
                taken = member.trajectory(samples, every // in_kernel)
                runs.append(BatchRun(member.scene, taken, ""))
            else:
                # A Drive says what went wrong, and where.
                diverged, spent = one_by_one([member], every)
                runs += diverged
            seconds += spent
        return runs, seconds

    def _samples(self, member: Prepared, every: int) -> tuple[np.ndarray, float]:
        """Each so-many-th of a run's samples, those that are sound, and CPU time [s]."""
        doubt(self._work.tables, len(member.system.balls))
        self._state[:] = start_state(member.scene, member.system)
        self._modes[:] = start_modes(member.scene, member.system)
        self._work.smooth[0] = math.nan
        for kept, _ in self._kernels.values():
            kept.begin_with(member.system)
        parts, seconds, width = [], 0.0, len(member.channels)
        for done in range(0, member.steps, _AT_ONCE):
            samples = np.empty((min(_AT_ONCE, member.steps - done), width))
            begin = time.thread_time()
            sound = self._advance(member, done, samples)
            seconds += time.thread_time() - begin
            parts.append(samples[(-1 - done) % every : sound : every])
            if sound < len(samples):
                break
        return parts[0] if len(parts) == 1 and every == 1 else np.concatenate(parts), seconds

    def _advance(self, member: Prepared, first: int, samples: np.ndarray) -> int:
        """Fill in samples, ``first`` steps having been taken before; how many were sound."""
        done = 0
        for leg, at in way_along(member.course).after(first):
            left = len(samples) - done
            kernel = self._kernel(leg.kind, member)
            taken = kernel(leg.table, at, first + done, left, math.nan, samples[done:])
            if taken < 0:
                return done - 1 - taken
            done += taken
            if done == len(samples):
                break
        return done

    def _kernel(self, kind: type[Segment], member: Prepared) -> Callable[..., int]:
        if kind not in self._kernels:
            fixed = member.system, place_along(kind), self._stepper.weights, self._step
            kept = Kept(Run(*fixed, self._state, self._modes, self._work, 0))
            self._kernels[kind] = kept, stepping(kept)
        return self._kernels[kind][1]

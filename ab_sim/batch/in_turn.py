"""Runs one after the other."""

import time
from collections.abc import Sequence

import numpy as np

from ab_sim.batch.prepared import BatchRun, Prepared
from ab_sim.drive import Drive
from ab_sim.drive.rows import RowReader, follow
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.assemble import place_on, start_modes, start_state, state_bounds
from ab_sim.errors import DivergedError
from ab_sim.integrate.fixed_step import advance
from ab_sim.integrate.response_tables import doubt
from ab_sim.integrate.workspace import aligned, workspace

_AT_ONCE = 10_000
"""Steps whose rows are in memory before they are thinned."""
_NO_SAMPLE = np.zeros(0)


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
        self._state, self._reader = aligned(bounds.shape), RowReader(first.scene, first.system)
        self._rows = aligned((min(first.steps, _AT_ONCE), self._reader.width))
        self._spindle = np.empty((len(self._rows), 3))

    def run(self, members: Sequence[Prepared], every: int) -> tuple[list[BatchRun], float]:
        """As ``one_by_one``."""
        runs, seconds = [], 0.0
        for member in members:
            begin = time.thread_time()
            taken = self._trajectory(member, every)
            spent = time.thread_time() - begin
            if taken is None:
                # A Drive says what went wrong, and where.
                diverged, spent = one_by_one([member], every)
                runs += diverged
            else:
                runs.append(BatchRun(member.scene, taken, ""))
            seconds += spent
        return runs, seconds

    def _trajectory(self, member: Prepared, every: int) -> Trajectory | None:
        """Of one run; None if it diverged."""
        # What a row says does not depend on a scene's numbers, but readings of sensors do.
        reader = self._reader
        if member.scene.sensors:
            reader = RowReader(member.scene, member.system)
        in_rows = 1 if member.scene.sensors else every
        doubt(self._work.tables, len(member.system.balls))
        self._state[:] = start_state(member.scene, member.system)
        modes, piece, kept = start_modes(member.scene, member.system), None, []
        for done in range(0, member.steps, len(self._rows)):
            steps = min(len(self._rows), member.steps - done)
            for stretch in member.way(done, steps):
                at = slice(stretch.first - done, stretch.first - done + max(stretch.steps, 1))
                if stretch.piece != piece:
                    self._work.memory[:] = 0.0
                    piece = stretch.piece
                taken = advance(
                    member.system,
                    place_on(stretch.piece),
                    self._stepper.weights,
                    stretch.piece.start,
                    (stretch.first, self._step, stretch.offset),
                    stretch.length,
                    self._state,
                    modes,
                    self._work,
                    0,
                    self._rows[at],
                    _NO_SAMPLE,
                )
                if taken < at.stop - at.start:
                    return None
                follow(stretch, self._step, self._spindle[at, :2])
            chosen = slice((-1 - done) % in_rows, steps, in_rows)
            self._spindle[:, 2] = self._spindle[:, 1]
            numbers = done + 1 + np.arange(steps)[chosen]
            kept.append(reader.trajectory(numbers, self._rows[chosen], self._spindle[chosen]))
        return Trajectory.join(kept).thinned(every // in_rows)

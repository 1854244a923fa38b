"""Runs of a batch that are computed one after the other."""

import time
from collections.abc import Sequence

from ab_sim.base.errors import DivergedError
from ab_sim.design.batch.prepared_run import BatchRun, PreparedRun
from ab_sim.drive import Drive


def run_one_by_one(members: Sequence[PreparedRun], every: int) -> tuple[list[BatchRun], float]:
    """Run each member in a Drive, keeping every ``every``-th step; return runs and CPU time [s]."""
    runs, seconds = [], 0.0
    for member in members:
        drive, failure = Drive(member.scene), ""
        begin = time.thread_time()
        try:
            taken = drive.advance(member.steps, every)
        except DivergedError as error:
            # Repeat the run up to the last finite state to get its samples.
            failure, sound = str(error), drive.steps
            drive.reset()
            taken = drive.advance(sound, every)
        seconds += time.thread_time() - begin
        aborted = drive.controller.aborted if drive.controller is not None else None
        why = "" if aborted is None else aborted.text
        runs.append(BatchRun(member.scene, taken, failure, why))
    return runs, seconds

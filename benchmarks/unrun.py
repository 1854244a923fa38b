"""What workers do that run nothing: then the rest is what sharing costs."""

import time
from collections.abc import Sequence

import pyarrow

from ab_sim.design.judged import Job, Point, schema_of


def unrun(job: Job, points: Sequence[Point]) -> pyarrow.Table:
    """A row for each point."""
    row = {merit: 0.1 for merit in job.merits}
    rows = [{"run": point.run, "outcome": "settled", **row} for point in points]
    return pyarrow.Table.from_pylist(rows, schema_of(job))


def wait_for(seconds: float, number: int) -> int:
    """Take this long, but no processor."""
    time.sleep(seconds)
    return number

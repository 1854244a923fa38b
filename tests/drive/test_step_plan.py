"""The way of a drive's steps: wherever one begins on it, it is what lies ahead from there."""

import math

import numpy as np
import pytest

from ab_sim.drive.steps import FOREVER, StepPlan
from ab_sim.engine.stepping.plan import END, FIRST, LENGTH, OFFSET, PLACE, START
from ab_sim.model.dynamics.assemble import active_segment
from ab_sim.model.spindle import RaisedCosine, Ramp, SpeedSchedule
from ab_sim.model.spindle.step_ranges import StepResolution, step_ranges

GRID = StepResolution(1e-3, 12e-3)
PROFILES = {
    "hold": SpeedSchedule.constant(100.0, 3.0),
    "off the grid": SpeedSchedule.start_up(10.0, 100.0, 20.0, (12.0, 0.0123, 200.0)),
    "within one step": SpeedSchedule([(0.0101, Ramp(1.0, 1.0)), (1e-4, Ramp(1.0, 5.0))], 30.0),
    "long curve": SpeedSchedule.speed_change(100.0, 300.0, 0.01, 0.0155),
    "short curve": SpeedSchedule.speed_change(100.0, 300.0, 0.0102, 0.0035),
}


@pytest.mark.parametrize("name", PROFILES)
def test_it_is_what_lies_ahead(name: str) -> None:
    """Of every step that it may be entered at."""
    profile = PROFILES[name]
    way = StepPlan.along(profile, GRID, 0)
    for begin in range(40):
        lines = []
        for leg, at in way.after(begin):
            assert leg.kind in (Ramp, RaisedCosine)
            lines += [(leg.kind, line) for line in leg.table[at:]]
        ahead = list(step_ranges(profile, GRID, begin, FOREVER))
        assert len(lines) == len(ahead)
        for k, ((kind, line), step_range) in enumerate(zip(lines, ahead, strict=True)):
            assert kind is type(step_range.scheduled.law)
            assert line[FIRST] <= begin if k == 0 else line[FIRST] == step_range.first
            assert [line[START], line[OFFSET], line[LENGTH]] == [
                step_range.scheduled.start,
                step_range.offset,
                step_range.length,
            ]
            assert line[PLACE:].tolist() == active_segment(step_range.scheduled).numbers


@pytest.mark.parametrize("name", PROFILES)
def test_each_line_ends_where_the_next_begins(name: str) -> None:
    """Parts of a step end none but the last of them, and the last stretch goes on for ever."""
    way = StepPlan.along(PROFILES[name], GRID, 0)
    table = np.concatenate([leg.table[:, :PLACE] for leg, _ in way.after(0)])
    assert table[0, FIRST] == 0 and table[-1, END] == FOREVER
    np.testing.assert_array_equal(table[:-1, END], table[1:, FIRST])
    assert (table[:, END] - table[:, FIRST] >= 0).all() and math.isfinite(table.sum())

"""Tables of responses that one drive leaves to the next: they change no bit, and nobody shares."""

import gc
from collections.abc import Iterator

import numpy as np
import pytest

from ab_sim.collocation import table_lending
from ab_sim.collocation.assemble import method_of
from ab_sim.collocation.responses import lines_of_table
from ab_sim.collocation.run import ResponseTables
from ab_sim.collocation.tables import COUNT
from ab_sim.drive import Drive
from ab_sim.integrate.steppers.collocation import EIGHT
from ab_sim.scene import load_scene

SMOOTH = ("effects.rolling_friction=", "solver.stepper=collocation")
NODES = method_of(EIGHT, 1e-11, 0.0).nodes


@pytest.fixture(autouse=True)
def _none_left() -> Iterator[None]:
    gc.collect()
    table_lending._returned.clear()
    yield
    table_lending._returned.clear()


def samples(*changes: str) -> bytes:
    """Of a new drive."""
    drive = Drive(load_scene("thesis-hold", (*SMOOTH, *changes)))
    return drive.advance(1500).samples.tobytes()


def left() -> ResponseTables:
    """What the last drive has left."""
    gc.collect()
    ((_, _, tables),) = table_lending._returned
    return tables


@pytest.mark.parametrize(
    "other",
    ["rotor.eccentricity=2e-4", "balls.mass=1.3e-3", "solver.step=2e-3", "race.radius=0.012"],
)
def test_what_a_drive_has_left_changes_no_bit(other: str) -> None:
    samples()
    first = left()
    after_it = samples(other)
    assert left() is first
    again = samples()
    table_lending._returned.clear()
    assert after_it == samples(other)
    table_lending._returned.clear()
    assert again == samples()


def test_the_next_drive_of_a_plant_makes_none() -> None:
    expected = samples()
    tables, size = left(), lines_of_table(8)
    # Nothing reads what a ball's c v + k x would be.
    pull = tables.lines[size + 16 : size + 24]
    assert pull.all()
    pull[:] = np.nan
    assert samples("rotor.eccentricity=2e-4") != expected == samples()
    assert left() is tables and np.isnan(pull).all()
    assert samples("balls.mass=1.3e-3") and not np.isnan(pull).any()


def test_drives_at_the_same_time_have_their_own() -> None:
    first = table_lending.borrowed_tables(NODES, 2)
    second = table_lending.borrowed_tables(NODES, 2)
    assert not np.shares_memory(first.lines, second.lines)
    kept = first.lines[5]
    base = first.lines.base
    del first
    gc.collect()
    third = table_lending.borrowed_tables(NODES, 2)
    assert third.lines.base is base and third.lines.base is not second.lines.base
    assert kept.base is base


def test_tables_of_another_kind_are_left_where_they_are() -> None:
    two = table_lending.borrowed_tables(NODES, 2)
    base = two.lines.base
    del two
    three = table_lending.borrowed_tables(NODES, 3)
    assert three.lines.shape[0] > 0 and three.lines.base is not base
    two = table_lending.borrowed_tables(NODES, 2)
    assert two.lines.base is base


def test_what_is_kept_is_bounded() -> None:
    for sides in (2, 3, 4):
        lent = table_lending.borrowed_tables(NODES, sides)
        del lent
    assert len(table_lending._returned) == 1 and table_lending._returned[0][1] == 4
    large = table_lending.borrowed_tables(NODES, 66)
    assert large.lines.nbytes > table_lending.LARGEST
    del large
    assert table_lending._returned[0][1] == 4


def test_tables_that_are_taken_over_are_looked_at() -> None:
    samples()
    assert (left().numbers[:, COUNT] >= 0.0).all() and (left().numbers[:, COUNT] > 0.0).any()
    tables = left()
    drive = Drive(load_scene("thesis-hold", (*SMOOTH, "balls.mass=1.3e-3")))
    drive.advance(1)
    every = (1 + tables.groups) * 3
    assert (tables.numbers[::every, COUNT] <= 0.0).sum() > (
        tables.numbers[::every, COUNT] > 0.0
    ).sum()

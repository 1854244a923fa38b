"""Where on a map balls can circulate: as a blind grid, a formula, and long runs have it."""

import json
import math

import numpy as np
import pytest

from ab_sim.analysis.circulating import drive_of, stalled
from ab_sim.analysis.maps import verdicts
from ab_sim.analysis.maps.plane import Plane, axes_of
from ab_sim.analysis.maps.stability import stability_map
from ab_sim.analysis.maps.verdicts import (
    CIRCULATES,
    NONE_CIRCULATES,
    NOT_COVERED,
    NOT_KNOWN,
    circulation_at,
)
from ab_sim.scene import load_scene
from tests.analysis.circulating.runs import mean_speeds, stalling

DRAG = "effects.viscous_drag.coefficient"
AXES = f"speed=250:2050:33,{DRAG}=0.02:0.2:17"


def plane(axes: str = AXES) -> Plane:
    return Plane(stalling(), 0.0, *axes_of(axes))


def test_refinement_gives_a_blind_grid_and_its_border_is_a_formula() -> None:
    found = stability_map(plane(), 4)
    blind = [[circulation_at(found.plane, (i, j)) for j in range(33)] for i in range(17)]
    np.testing.assert_array_equal(found.circulating, blind)
    assert {*found.circulating.ravel()} == {CIRCULATES, NONE_CIRCULATES, NOT_KNOWN}
    # Six balls part where the bunch turns at the critical speed.
    critical = math.sqrt(58800.0 / 0.524)
    top = 6 * (4e-3) ** 2 * critical**3 / 20.0
    w, drag = np.meshgrid(found.plane.across.values, found.plane.up.values)
    beyond = drag * (w - critical) > top
    np.testing.assert_array_equal(found.circulating == NONE_CIRCULATES, beyond)


def test_what_coexists_is_told_in_numbers() -> None:
    found = stability_map(plane(), 4)
    both = found.balanced & (found.circulating == CIRCULATES)
    np.testing.assert_array_equal(found.coexisting, both)
    report = json.loads(json.dumps(found.report()))["circulation"]
    assert report["labels"] == found.circulating.tolist()
    assert report["share"] == pytest.approx((found.circulating == CIRCULATES).mean())
    assert 0.1 < report["share_coexisting"] == pytest.approx(both.mean())
    assert report["reason_not_covered"] is None


def test_long_runs_agree_on_both_sides() -> None:
    """At points next to the border, begun in the state that is just inside."""
    found = stability_map(plane(), 4)
    for i in (2, 6, 10, 14):
        row = found.circulating[i]
        last = int(np.flatnonzero(row == CIRCULATES)[-1])
        if last + 1 == len(row):
            continue
        scene, inside = found.plane.at(i, last)
        numbers = drive_of(scene)
        assert numbers is not None
        begin = stalled(numbers, inside, 6)
        assert begin is not None
        assert mean_speeds(scene, inside, begin) == pytest.approx(begin.speed, rel=2e-3)
        _, outside = found.plane.at(i, last + 1)
        assert mean_speeds(scene, outside, begin) == pytest.approx(outside, rel=1e-3)


def test_what_is_known_is_not_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    first = stability_map(plane(), 8)
    monkeypatch.setattr(verdicts, "drive_of", lambda *_: 1 / 0)
    np.testing.assert_array_equal(stability_map(plane(), 8).circulating, first.circulating)


def test_where_it_is_not_looked_for_it_says_why() -> None:
    axes = axes_of(f"speed=100:400:3,{DRAG}=0.1:1:2")
    found = stability_map(Plane(load_scene("packed-balls"), 0.0, *axes), 2)
    assert {*found.circulating.ravel()} == {NOT_COVERED}
    report = found.report()["circulation"]
    assert isinstance(report, dict) and report["reason_not_covered"].startswith(
        "effects.ball_contact"
    )
    assert report["share"] == 0.0

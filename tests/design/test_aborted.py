"""Runs whose start-up is aborted are an outcome of their own: at standstill nothing whirls."""

from typing import Any

import numpy as np
import pytest

import ab_sim
from ab_sim.analysis import run_scene
from ab_sim.design.judged import ABORTED
from ab_sim.design.points import points_of, variable_of
from ab_sim.design.sweep import run_sweep

WHY = "a reading beyond the limit"
METRIC = "final_whirl_over_e"


@pytest.fixture(scope="module")
def found() -> Any:
    scene = ab_sim.load_scene("adaptive-start-up", ["duration=4"])
    points = points_of([variable_of("sensors.pick_up.range=0.5,1000")], None)
    return run_sweep(scene, points, (METRIC, "balanced"))


def test_it_is_neither_settled_nor_the_best(found: Any) -> None:
    assert found["outcome"][0] == ABORTED != found["outcome"][1]
    assert found["failure"].tolist() == [WHY, None]
    assert np.isnan(found[METRIC]).tolist() == [True, False]
    assert found.outcomes[ABORTED] == 1 and found.reasons == {ABORTED: WHY}
    assert found.best(METRIC) != 0


def test_a_run_says_so_in_place_of_its_final_whirl() -> None:
    scene = ab_sim.load_scene("adaptive-start-up", ["duration=2", "sensors.pick_up.range=0.5"])
    run = run_scene(scene)
    assert run.aborted is not None and run.aborted.text == WHY
    assert run.report()["aborted"] == {"t": run.aborted.time, "text": WHY}
    assert f"aborted at {run.aborted.time:.1f} s: {WHY}" in (
        axes.get_title() for axes in run.plot().axes
    )
    assert "at the end" not in repr(run) and WHY in repr(run)

"""Basins: runs from a grid of start angles, and the starts that are none."""

import math

import numpy as np
import pytest

from ab_sim.analysis.merits import merits_of
from ab_sim.analysis.offline import run_scene
from ab_sim.errors import InputError, SceneError
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene
from ab_sim.studies.basin import BALANCED, CIRCULATING, LEFT_OUT, NOT_BALANCED, basin
from tests.conftest import SceneMaker

SHORT = {
    "balls": {"count": 2, "mass": 7e-4, "radius": 1e-3},
    "profile": {"kind": "start_up", "acceleration": 100.0, "target_speed": 200.0},
    "duration": 3.0,
}


def label_of_run(scene: Scene, one: float, other: float, limit: float) -> int:
    """By the run alone, exchanged or not."""
    changed = changed_scene(scene, {"start.ball_angles": [one, other]}, "test")
    residual = merits_of(run_scene(changed).trajectory, changed).residual_unbalance
    assert residual is not None
    return BALANCED if residual <= limit else NOT_BALANCED


def test_equal_balls_may_be_exchanged_and_the_diagonal_is_left_out(scene: SceneMaker) -> None:
    made = scene(**SHORT)
    limit = 0.3
    found = basin(made, 8, limit)
    labels = np.where(found.labels == 2, NOT_BALANCED, found.labels)
    np.testing.assert_array_equal(labels, labels.T)
    assert (np.diag(labels) == LEFT_OUT).all() and (labels == LEFT_OUT).sum() == 8
    assert {*labels.ravel().tolist()} == {BALANCED, NOT_BALANCED, LEFT_OUT}
    # Those below the diagonal were not run: run some.
    for i, j in ((5, 1), (7, 2), (3, 0), (6, 5)):
        assert labels[i, j] == label_of_run(made, found.angles[j], found.angles[i], limit)
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_balls_that_differ_are_all_run(scene: SceneMaker) -> None:
    made = scene(**{**SHORT, "balls": {"count": 2, "mass": [7e-4, 9e-4], "radius": 1e-3}})
    found = basin(made, 4)
    assert not (found.labels == LEFT_OUT).any()
    residual = np.array([[end.residual_unbalance for end in row] for row in found.ends])
    assert not np.allclose(residual, residual.T)


def test_what_was_run_is_kept_whatever_the_limit(scene: SceneMaker) -> None:
    made = scene(**SHORT)
    first, told = basin(made, 4, 0.3), []
    again = basin(made, 4, 10.0, tell=lambda what, done, total: told.append((done, total)))
    assert told == [(10, 10)]
    assert first.report()["residual_unbalance"] == again.report()["residual_unbalance"]
    assert {*again.shares} == {BALANCED}


def test_balls_that_circulate_are_an_end_of_their_own(scene: SceneMaker) -> None:
    """Two balls so heavy and slippery that from every start they stall near the critical speed."""
    made = scene(
        balls={"count": 2, "mass": 1.2e-2},
        effects={"viscous_drag": {"coefficient": 0.05}},
        spindle={"max_speed": 1300.0, "max_acceleration": 1000.0},
        profile={"kind": "start_up", "acceleration": 400.0, "target_speed": 1152.0},
        duration=8.0,
    )
    found = basin(made, 3)
    assert found.shares == {CIRCULATING: 1.0}
    (kind,) = found.report()["kinds"]
    assert kind["name"] == "not balanced, balls circulate"


@pytest.mark.parametrize(
    ("changes", "count", "limit", "words"),
    [
        ({"balls": {"count": 1}}, 4, 0.05, "balls.count = 1: a basin is drawn over"),
        ({"rotor": {"eccentricity": 0.0}}, 4, 0.05, "rotor.eccentricity = 0 m"),
        ({"balls": {"count": 4}}, 4, 0.05, "the equal balls 3 and 4 start at one angle"),
        ({}, 1, 0.05, "basin: 1 angles: must be from 2 to 1000"),
        ({}, 4, math.nan, "limit nan: must be a positive share"),
        ({}, 4, 0.0, "limit 0: must be a positive share"),
    ],
)
def test_what_has_no_basin(
    scene: SceneMaker, changes: dict[str, dict[str, float]], count: int, limit: float, words: str
) -> None:
    with pytest.raises((InputError, SceneError)) as error:
        basin(scene(**changes), count, limit)
    assert words in str(error.value)

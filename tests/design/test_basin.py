"""Basins: runs from a grid of start angles, and the starts that are none."""

import numpy as np
import pytest

from ab_sim.analysis.offline import run_scene
from ab_sim.base.errors import InputError, SceneError
from ab_sim.design.basin import (
    BALANCED,
    CHANGING,
    CIRCULATING,
    LEFT_OUT,
    NAMES,
    RINGING_DOWN,
    basin,
)
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene
from ab_sim.scene.sections import Balanced
from tests.conftest import SceneMaker

SHORT = {
    "balls": {"count": 2, "mass": 7e-4, "radius": 1e-3},
    "profile": {"kind": "start_up", "acceleration": 100.0, "target_speed": 200.0},
    "duration": 3.0,
}


def label_of_run(scene: Scene, one: float, other: float) -> int:
    """By the run's own verdict, exchanged or not."""
    changed = changed_scene(scene, {"start.ball_angles": [one, other]}, "test")
    verdict = run_scene(changed).metrics.verdict
    return next(label for label, name in NAMES.items() if name == verdict)


def test_equal_balls_may_be_exchanged_and_the_diagonal_is_left_out(scene: SceneMaker) -> None:
    made = scene(**SHORT, balanced={"residual_unbalance": 0.3})
    found = basin(made, 8)
    labels = found.labels
    np.testing.assert_array_equal(labels, labels.T)
    assert (np.diag(labels) == LEFT_OUT).all() and (labels == LEFT_OUT).sum() == 8
    assert {LEFT_OUT, CHANGING} < {*labels.ravel().tolist()} and found.limit == 0.3
    # Those below the diagonal were not run: run some.
    for i, j in ((5, 1), (7, 2), (3, 0), (6, 5)):
        assert labels[i, j] == label_of_run(made, found.angles[j], found.angles[i])
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_balls_that_differ_are_all_run(scene: SceneMaker) -> None:
    made = scene(**{**SHORT, "balls": {"count": 2, "mass": [7e-4, 9e-4], "radius": 1e-3}})
    found = basin(made, 4)
    assert not (found.labels == LEFT_OUT).any()
    residual = np.array([[end.residual_unbalance for end in row] for row in found.ends])
    assert not np.allclose(residual, residual.T)


def test_it_has_the_verdicts_and_the_limit_of_every_run(scene: SceneMaker) -> None:
    """One definition: the default limit is that of `run`, and the scene sets another one."""
    assert basin(scene(**SHORT), 4).limit == Balanced().residual_unbalance
    wide = basin(scene(**SHORT, balanced={"residual_unbalance": 10.0}), 4)
    assert {*wide.shares} <= {BALANCED, RINGING_DOWN, CHANGING}
    again, told = [], []
    for found in (wide, basin(wide.scene, 4, progress=lambda *now: told.append(now[1:]))):
        again.append(found.report())
    assert again[0] == again[1] and told == [(10, 10)], "kept"


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
    ("changes", "count", "words"),
    [
        ({"balls": {"count": 1}}, 4, "balls.count = 1: a basin is drawn over"),
        ({"rotor": {"eccentricity": 0.0}}, 4, "rotor.eccentricity = 0 m"),
        ({"balls": {"count": 4}}, 4, "equal balls 3 and 4"),
        ({}, 1, "basin: 1 angles: "),
    ],
)
def test_what_has_no_basin(
    scene: SceneMaker, changes: dict[str, dict[str, float]], count: int, words: str
) -> None:
    with pytest.raises((InputError, SceneError)) as error:
        basin(scene(**changes), count)
    assert words in str(error.value)

"""Maps of what is stable: as a blind grid, whoever computes them, and as far as they are known."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gallery.three_ball.drive import DAMPING, drive

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.analysis.equilibria.at_speed import balanced_state
from ab_sim.analysis.equilibria.balanced import positions
from ab_sim.analysis.equilibria.resting import resting_system, rotor_of
from ab_sim.analysis.maps import stability
from ab_sim.analysis.maps.family import BallCountComparison, plane_with_balls, with_balls
from ab_sim.analysis.maps.plane import SPEED, Plane, axes_of, axis
from ab_sim.analysis.maps.stability import StabilityMap, label_at, stability_map
from ab_sim.analysis.maps.verdicts import (
    CLUSTERED,
    EVERYWHERE,
    NO_STATE,
    NOTHING,
    PLAIN,
    SOMEWHERE,
    UNDECIDED,
    label_of,
    name_of,
    verdict,
)
from ab_sim.base.errors import InputError, SceneError
from ab_sim.scene import load_scene
from tests.forked import start_workers_at_once

AXES = "speed=100:400:33,effects.suspension.damping=1:60:33"


def nsc(*changes: str) -> Plane:
    return Plane(load_scene("nsc-case-3", changes), 0.0, *axes_of(AXES))


def region(total: float, balls: int, points: int = 13) -> StabilityMap:
    """The three-ball paper's plane, zeta_B = 0.1; coarse."""
    across, up = axis(SPEED, 1.0, 3.0, points), axis(DAMPING, 0.2, 1.0, points)
    return stability_map(Plane(drive(total / balls, balls), 0.0, across, up), 2)


def test_refinement_gives_the_labels_of_a_blind_grid() -> None:
    plane = nsc()
    found = stability_map(plane, 8)
    blind = [[label_at(plane, (i, j)) for j in range(33)] for i in range(33)]
    np.testing.assert_array_equal(found.labels, blind)
    assert found.computed.sum() < 0.3 * found.labels.size
    assert {*found.shares} == {EVERYWHERE, CLUSTERED, NOTHING}
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_what_is_known_is_not_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    first = stability_map(nsc(), 8)
    calls: list[Any] = []
    monkeypatch.setattr(stability, "verdict", lambda *point: calls.append(point) or 0)
    again = stability_map(nsc(), 8)
    assert not calls
    np.testing.assert_array_equal(first.labels, again.labels)
    np.testing.assert_array_equal(first.computed, again.computed)
    stability_map(nsc("effects.viscous_drag.coefficient=0.3"), 32)
    assert calls, "another scene's are not taken for it"


def test_an_interrupted_map_goes_on(monkeypatch: pytest.MonkeyPatch, own_results: Path) -> None:
    def stop(what: str, done: int, total: int) -> None:
        if done == 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stability_map(nsc(), 8, tell=stop)
    assert len([*own_results.iterdir()]) == 1
    told: list[tuple[int, int]] = []
    found = stability_map(nsc(), 8, tell=lambda what, done, total: told.append((done, total)))
    assert told[0] == (20, 25), "of 5 by 5 coarse points, 20 were there"
    np.testing.assert_array_equal(found.labels, stability_map(nsc(), 8).labels)


def test_fast_verdicts_of_three_balls_are_those_of_all_their_states() -> None:
    draw = np.random.default_rng(3)
    seen = set()
    for k in range(24):
        eta = (0.3, 0.4, 0.8)[k % 3]
        scene = drive(eta, 3, draw.uniform(0.01, 0.5), draw.uniform(0.05, 0.3))
        speed = float(draw.uniform(0.5, 3.0))
        label = verdict(scene, speed)
        assert label == label_of(equilibria_of(scene, speed).branches)
        seen.add(label)
    assert {EVERYWHERE, SOMEWHERE, CLUSTERED, NOTHING} <= seen


def test_a_position_between_samples_counts() -> None:
    """Balanced at a few positions only, of which no sample is one."""
    scene, speed = drive(0.8, 3, 0.1, 0.0332), 1.25
    system = resting_system(scene)
    own = rotor_of(system)
    assert own is not None
    assert not any(balanced_state(system, own, speed, x).stable for x in positions(own))
    assert verdict(scene, speed) & SOMEWHERE


@pytest.mark.parametrize(("masses", "known"), [("1e-3", "all"), ("[1e-3, 2e-3, 1e-3]", "sampled")])
def test_a_map_says_which_positions_it_is_of(masses: str, known: str) -> None:
    scene = load_scene(
        "nsc-case-3", ["balls.count=3", f"balls.mass={masses}", "start.ball_angles="]
    )
    plane = Plane(scene, 0.0, axis("speed", 100.0, 200.0, 2), axis(DAMPING, 1.0, 2.0, 2))
    found = stability_map(plane, 1)
    assert found.balanced_positions == found.report()["balanced_positions"] == known


def test_the_degenerate_case_is_undecided() -> None:
    assert verdict(load_scene("nsc-case-2"), 900.0) & UNDECIDED


@pytest.mark.parametrize(
    ("speed", "changes", "label", "name"),
    [
        (900.0, (), EVERYWHERE, "balanced"),
        (100.0, (), CLUSTERED, "clustered"),
        (188.0, (), NOTHING, "nothing stable"),
        (-900.0, (), EVERYWHERE, "balanced"),
        (900.0, ("balls.count=0", "start.ball_angles="), PLAIN, "at rest without balls"),
    ],
)
def test_labels(speed: float, changes: tuple[str, ...], label: int, name: str) -> None:
    found = verdict(load_scene("nsc-case-3", changes), speed)
    assert found == label and name_of(found) == name


def test_no_state_is_a_label_too() -> None:
    """One ball that is too heavy, at w_n: between its folds nothing can rest."""
    scene = load_scene("nsc-case-3", ["balls.count=1", "start.ball_angles=", "balls.mass=0.02"])
    speed = scene.critical_speed
    assert speed is not None
    assert verdict(scene, speed) == NO_STATE and name_of(NO_STATE) == "no resting state"


def test_three_balls_against_two() -> None:
    """As the three-ball paper claims of the union over positions; and not of every position.

    Speeds from w_n, zeta from 0.1: at 1.2 three are ahead with every position, at 2.4 with some
    only, and behind with every one.
    """
    light = BallCountComparison(region(1.2, 3), region(1.2, 2))
    heavy = BallCountComparison(region(2.4, 3), region(2.4, 2))
    assert light.everywhere.only_other == 0.0
    assert light.somewhere.both > 0.6
    assert heavy.somewhere.only_ours > 0.05 and heavy.somewhere.only_other == 0.0
    assert heavy.everywhere.only_other > 0.1 and heavy.everywhere.only_ours == 0.0
    report = heavy.report()
    assert report["balls"] == [3, 2]
    assert sum(report["stable_at_every_position"].values()) == pytest.approx(
        (heavy.ours.balanced_everywhere | heavy.other.balanced_everywhere).mean()
    )
    assert not (heavy.ours.balanced_everywhere & ~heavy.ours.balanced).any()


def test_as_many_balls_together_as_heavy() -> None:
    scene = load_scene("nsc-case-3")
    other = with_balls(scene, 5)
    assert other.balls.count == 5 and other.start.ball_angles is None
    assert other.balls.total_mass == pytest.approx(scene.balls.total_mass, rel=1e-14)
    assert other.total_mass == pytest.approx(scene.total_mass, rel=1e-14)
    assert other.eccentric_mass == scene.eccentric_mass
    drag, own = (s.effects["viscous_drag"].coefficient for s in (other, scene))
    assert 5 * drag == pytest.approx(2 * own)
    assert with_balls(other, 2).balls.masses == pytest.approx(scene.balls.masses, rel=1e-14)


@pytest.mark.parametrize(
    ("changes", "count", "axes", "words"),
    [
        (("balls.mass=[1e-4, 2e-4]",), 3, AXES, "balls of different masses"),
        ((), 0, AXES, "against 0 balls: "),
        ((), 65, AXES, "balls.count = 65"),
        ((), 3, "balls.mass=1e-4:2e-4,speed=1:2", "balls.mass is on an axis"),
        ((), 3, "effects.viscous_drag.coefficient=1:2,speed=1:2", "is on an axis"),
    ],
)
def test_what_cannot_be_compared(
    changes: tuple[str, ...], count: int, axes: str, words: str
) -> None:
    plane = Plane(load_scene("nsc-case-3", changes), 0.0, *axes_of(axes))
    with pytest.raises((InputError, SceneError)) as error:
        plane_with_balls(plane, count)
    assert words in str(error.value)


def test_a_scene_in_which_nothing_rests_says_so() -> None:
    plane = Plane(load_scene("on-edge"), 0.0, *axes_of("speed=50:60:3,race.radius=0.01:0.02:3"))
    with pytest.raises(SceneError, match="spindle's angle"):
        stability_map(plane)


def test_two_processes_give_what_one_does(
    own_results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = stability_map(nsc(), 8)
    for file in own_results.iterdir():
        file.unlink()
    start_workers_at_once(monkeypatch)
    monkeypatch.setattr(stability, "verdict", lambda *_: NO_STATE)  # of this process only
    two = stability_map(nsc(), 8, workers=2)
    assert (two.labels == NO_STATE).sum() <= 2, "but for what showed that it takes long"
    np.testing.assert_array_equal(
        *(np.where(two.labels == NO_STATE, 0, m.labels) for m in (one, two))
    )

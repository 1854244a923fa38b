"""Draws of built drives: their distributions, what they depend on, and what they do not."""

import math

import numpy as np
import pytest
from scipy import stats

import ab_sim
from ab_sim.base.errors import InputError
from ab_sim.design.draws import DrawnPoints, ExchangedPoints
from ab_sim.design.judged import Job, varied_scene
from ab_sim.design.tolerances import tolerance_of

SCENE = ("thesis-hold", "balls.mass=1 g", "rotor.eccentricity=0.1 mm")
MANY = 4000


def drawn(*texts: str, count: int = MANY, seed: int = 0, scene: tuple[str, ...] = SCENE):
    tolerances = [tolerance_of(text) for text in texts]
    return DrawnPoints(ab_sim.load_scene(scene[0], scene[1:]), tolerances, count, seed)


def column(points: DrawnPoints, key: str) -> np.ndarray:
    place = points.keys.index(key)
    return np.array([points.at(run)[place] for run in range(len(points))])


@pytest.mark.parametrize(
    ("text", "law"),
    [
        ("balls.mass=5%", stats.norm(1e-3, 5e-5)),
        ("balls.mass=10 mg", stats.norm(1e-3, 1e-5)),
        ("balls.mass=normal:2 g,0.1 g", stats.norm(2e-3, 1e-4)),
        ("balls.mass=5%, low=-5%, high=10%", stats.truncnorm(-1, 2, 1e-3, 5e-5)),
        ("rotor.eccentricity=lognormal:0.2 mm,40%", stats.lognorm(0.4, 0, 2e-4)),
        ("rotor.eccentricity=lognormal:40%", stats.lognorm(0.4, 0, 1e-4)),
        ("start.speed=uniform:10,20", stats.uniform(10, 10)),
        ("balls.mass=uniform:5%", stats.uniform(0.95e-3, 0.1e-3)),
    ],
)
def test_draws_have_the_distribution_that_is_written(text: str, law: object) -> None:
    values = column(drawn(text, seed=1), text.partition("=")[0])
    assert len(set(values)) == MANY
    assert stats.kstest(values, law.cdf).pvalue > 0.01  # type: ignore[attr-defined]
    neighbours = stats.spearmanr(values[:-1], values[1:])
    assert neighbours.pvalue > 0.01, "independent of the run before"


def test_discrete_values_have_the_same_chance_and_those_given_twice_have_two() -> None:
    values = column(drawn("balls.count=discrete:1,2,2"), "balls.count")
    counts = [int(np.sum(values == each)) for each in (1, 2)]
    assert stats.binomtest(counts[0], MANY, 1 / 3).pvalue > 0.01 and sum(counts) == MANY
    assert values.dtype.kind == "i"


def test_balls_have_one_draw_or_each_its_own() -> None:
    common = column(drawn("balls.mass=5%"), "balls.mass")
    assert common.shape == (MANY,)
    own = column(drawn("balls.mass=5% per ball"), "balls.mass")
    assert own.shape == (MANY, 2)
    assert abs(np.corrcoef(own.T)[0, 1]) < 0.05
    for ball in range(2):
        assert stats.kstest(own[:, ball], stats.norm(1e-3, 5e-5).cdf).pvalue > 0.01
    both = column(drawn("balls.mass=5% per ball", "balls.mass=10%"), "balls.mass")
    # Correlated by the tolerance that they share: 10^2 of 10^2 + 5^2.
    assert np.corrcoef(both.T)[0, 1] == pytest.approx(0.8, abs=0.03)


def test_a_scenes_own_list_is_spread_ball_by_ball() -> None:
    scene = ("thesis-hold", "balls.mass=[0.001, 0.003]")
    common = column(drawn("balls.mass=5%", scene=scene), "balls.mass")
    assert np.allclose(common[:, 1], 3 * common[:, 0], rtol=1e-12)
    own = column(drawn("balls.mass=5% per ball", scene=scene), "balls.mass")
    assert own.mean(0) == pytest.approx([1e-3, 3e-3], rel=0.01)
    assert abs(np.corrcoef(own.T)[0, 1]) < 0.05


def test_a_group_has_one_draw() -> None:
    points = drawn(
        "balls.mass=5%, per ball, group=steel",
        "balls.radius=uniform:1%, per ball, group=steel",
        "rotor.eccentricity=5%",
    )
    assert points.factors == ("group steel", "rotor.eccentricity")
    masses, radii = column(points, "balls.mass"), column(points, "balls.radius")
    for ball in range(2):
        assert stats.spearmanr(masses[:, ball], radii[:, ball])[0] == pytest.approx(1.0)
    assert abs(np.corrcoef(masses[:, 0], radii[:, 1])[0, 1]) < 0.05


def test_a_run_is_the_same_whatever_is_beside_it() -> None:
    one = drawn("balls.mass=5%", count=3000)
    assert [one.at(run) for run in (2999, 0, 1500)] == [
        one.of(count).at(run) for count, run in ((10**6, 2999), (1, 0), (2000, 1500))
    ]
    beside = drawn("rotor.eccentricity=1%", "balls.mass=5%", count=10)
    assert [beside.at(run)[1] for run in range(10)] == [one.at(run)[0] for run in range(10)]
    assert one.report() == one.of(7).report()
    other = drawn("balls.mass=5%", seed=1)
    assert other.at(0) != one.at(0) and other.report() != one.report()


def test_random_angles_are_uniform_on_the_circle() -> None:
    angles = column(drawn("start.ball_angles=random"), "start.ball_angles")
    assert angles.shape == (MANY, 2) and np.abs(angles).max() <= math.pi
    for ball in range(2):
        law = stats.uniform(-math.pi, 2 * math.pi)
        assert stats.kstest(angles[:, ball], law.cdf).pvalue > 0.01
    assert abs(np.corrcoef(angles.T)[0, 1]) < 0.05


@pytest.mark.parametrize(
    "changes", [(), ("effects.race_runout.lobe=0.0005", "effects.race_runout.lobe_angle=0.3")]
)
def test_balls_that_cannot_overlap_start_where_they_do_not(changes: tuple[str, ...]) -> None:
    texts = ("start.ball_angles=random", "balls.radius=5% per ball", "race.radius=1%")
    points = drawn(*texts, count=300, scene=("packed-balls", *changes))
    job = Job(points.scene, points.keys, ())
    for run in range(300):
        varied_scene(job, points.at(run))  # would refuse those that overlap


def test_arrangements_without_overlap_have_the_same_chance() -> None:
    """Of two balls the angle between them is uniform over what they leave free."""
    scene = ("packed-balls", "balls.count=2", "balls.radius=2 mm")
    points = drawn("start.ball_angles=random", scene=scene)
    angles = column(points, "start.ball_angles")
    apart = 2 * math.asin(2e-3 / points.scene.race.radius)
    between = (angles[:, 1] - angles[:, 0]) % (2 * math.pi)
    law = stats.uniform(apart, 2 * math.pi - 2 * apart)
    assert stats.kstest(between, law.cdf).pvalue > 0.01


def test_three_balls_are_as_if_refused_ones_were_drawn_again() -> None:
    """The smallest gap, beside that of plain draws of which those that overlap are left out."""
    scene = ("packed-balls", "balls.count=3", "balls.radius=2 mm")
    points = drawn("start.ball_angles=random", scene=scene)
    apart = 2 * math.asin(2e-3 / points.scene.race.radius)

    def gaps(angles: np.ndarray) -> np.ndarray:
        ring = np.sort(angles, axis=1)
        last = ring[:, :1] + 2 * math.pi - ring[:, -1:]
        return np.hstack([np.diff(ring, axis=1), last]).min(1)

    plain = gaps(np.random.default_rng(1).uniform(-math.pi, math.pi, (MANY * 4, 3)))
    ours = gaps(column(points, "start.ball_angles"))
    assert ours.min() > apart - 1e-9
    assert stats.ks_2samp(ours, plain[plain > apart]).pvalue > 0.01


def test_a_count_that_varies_has_as_many_angles() -> None:
    points = drawn("start.ball_angles=random per ball", "balls.count=discrete:1,2,3", count=50)
    for run in range(50):
        angles, count = points.at(run)
        assert len(angles) == count


def test_exchanged_drives_have_one_factor_of_the_next_one() -> None:
    points = drawn("balls.mass=5%", "rotor.eccentricity=5%", "start.ball_angles=random", count=20)
    exchanged = ExchangedPoints(points, 10)
    assert len(exchanged) == 30 and exchanged.keys == points.keys
    for pair in range(10):
        one, other = points.at(2 * pair), points.at(2 * pair + 1)
        for place in range(3):
            expected = tuple(other[k] if k == place else one[k] for k in range(3))
            assert exchanged.at(3 * pair + place) == expected
    assert exchanged.report() != points.report()


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        ((), "nothing is spread"),
        (("balls.mass=5%", "balls.mass=normal:1,2"), "balls.mass: varies twice"),
        (("rotor.mass=5%",), "thesis-hold has no value"),
        (("start.speed=5%",), "a share of 0 is 0"),
        (("rotor.inertia=5%",), "has no value"),
        (("balls.mass=5%, group=a", "balls.radius=1% per ball, group=a"), "group=a: balls.radius"),
    ],
)
def test_what_does_not_fit_the_scene_is_said(texts: tuple[str, ...], words: str) -> None:
    with pytest.raises(InputError) as raised:
        drawn(*texts)
    assert words in str(raised.value), raised.value
    with pytest.raises(InputError, match="^start.ball_angles: .* no-ball has no balls"):
        drawn("start.ball_angles=random", scene=("no-ball",))
    with pytest.raises(InputError, match="mounts.0 to mounts.3, and no '4'"):
        drawn("mounts.4.stiffness=5%", scene=("feeding-deck",))
    with pytest.raises(InputError, match="balls.mass.1: lies within balls.mass"):
        drawn("balls.mass=5%", "balls.mass.1=1%")
    with pytest.raises(InputError, match="0 runs: must be from 1"):
        drawn("balls.mass=5%", count=0)

"""Whether a rotor is balanced, and to what grade."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

import ab_sim
from ab_sim.analysis import metrics_of, run_scene
from ab_sim.analysis.metrics.metric import Display, metrics_named
from ab_sim.analysis.metrics.wording import angles_text, final_text
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import check_scene, load_scene
from tests.analysis.made import made

E = 1e-4
KEYS = ["balanced", "residual_unbalance", "balls_circulate", "settled", "verdict"]


@pytest.mark.parametrize("name", ["thesis-hold", "couple-unbalance", "no-ball"])
def test_the_grade_is_the_speed_of_the_mass_centre(name: str) -> None:
    """In the plane, in space, without balls: from each sample's mass centre of what turns."""
    run = run_scene(load_scene(name, ["duration=4"]))
    path, scene = run.trajectory, run.scene
    masses, radius = np.array(scene.balls.masses), scene.race.radius
    rows = path.ball_angles[-round(len(path) / 10) :]
    x = scene.eccentric_mass * scene.rotor.eccentricity + np.cos(rows) @ (masses * radius)
    y = np.sin(rows) @ (masses * radius)
    centre = np.hypot(x, y) / (scene.eccentric_mass + masses.sum())
    expected = 1e3 * math.sqrt(np.mean(centre**2)) * path["speed"][-1]
    assert run.metrics["balance_grade"] == pytest.approx(expected, rel=1e-12)
    if name == "no-ball":
        assert run.metrics["balance_grade"] == pytest.approx(
            1e3 * scene.rotor.eccentricity * path["speed"][-1], rel=1e-12
        )


def test_balls_alone_have_a_grade_too(scene: Any) -> None:
    """A rotor without an unbalance: two balls side by side, R 2 m / (M0 + 2 m) off the shaft."""
    run = made(balls=2, speed=lambda t: 0 * t - 300.0)
    metrics = metrics_of(run, scene(rotor={"eccentricity": 0.0}))
    assert metrics.balance_grade == pytest.approx(0.01 * 2e-3 / 0.1 * 300.0)
    assert metrics.balanced is None and metrics.residual_unbalance is None


def at_rest(degrees: float, **channels: Any) -> Trajectory:
    """Two balls at +- an angle; they balance the thesis' rotor at 119.34 deg."""
    return made(
        balls=2,
        step=1e-2,
        ball_0_angle=lambda t: 0 * t + math.radians(degrees),
        ball_1_angle=lambda t: 0 * t - math.radians(degrees),
        **channels,
    )


def share(degrees: float) -> float:
    return abs(1 + 2e-5 / 9.8e-6 * math.cos(math.radians(degrees)))


@pytest.mark.parametrize("degrees", [100.0, 116.0, 117.0, 119.34, 121.0, 123.0, 140.0])
@pytest.mark.parametrize("limit", [None, 0.01, 0.1, 0.5])
def test_a_rotor_is_balanced_to_the_scenes_limit(scene: Any, degrees: float, limit: Any) -> None:
    changes = {} if limit is None else {"balanced": {"residual_unbalance": limit}}
    metrics = metrics_of(at_rest(degrees), scene(**changes), KEYS)
    assert metrics["residual_unbalance"] == pytest.approx(share(degrees), rel=1e-9)
    assert metrics["balanced"] is (share(degrees) <= (0.1 if limit is None else limit))


@pytest.mark.parametrize(
    ("size", "ratio", "verdict"),
    [
        (0.5, 0.5, "balanced, ringing down"),
        (0.5, 2.0, "not balanced, still changing"),
        (0.5, 1.0, "balanced"),
        (0.03, 0.5, "balanced"),
        (0.03, 2.0, "balanced"),
    ],
)
def test_a_whirl_that_falls_rings_down_and_one_that_rises_is_not_balanced(
    scene: Any, size: float, ratio: float, verdict: str
) -> None:
    """Small, within 5 % of M0 e / M, which is 0.049 e here, it has settled anyhow."""
    run = at_rest(119.34, x=lambda t: E * size * ratio ** (t - 10))
    metrics = metrics_of(run, scene(), KEYS)
    assert metrics["verdict"] == verdict
    assert metrics["balanced"] is verdict.startswith("balanced")
    assert metrics["settled"] is (verdict == "balanced")


def test_balls_that_move_away_from_balance_do_not_ring_down(scene: Any) -> None:
    """The whirl falls, and what is left of the unbalance, 0.02 to 0.09, grows."""
    falls = {"x": lambda t: E * 0.5 ** (t - 10)}
    for rate, verdict in ((0.01, "not balanced, still changing"), (0.0, "balanced, ringing down")):
        run = made(
            balls=2, step=1e-2, **falls,
            ball_0_angle=lambda t, r=rate: math.radians(119.34) + r * (4 * t - 35),
            ball_1_angle=lambda t, r=rate: -math.radians(119.34) - r * (4 * t - 35),
        )  # fmt: skip
        metrics = metrics_of(run, scene(), KEYS)
        assert metrics["residual_unbalance"] < 0.1 and metrics["verdict"] == verdict


def test_without_balls_or_unbalance_there_is_no_balance(scene: Any) -> None:
    rises = {"x": lambda t: E * 2.0 ** (t - 10)}
    smooth = scene(rotor={"eccentricity": 0.0})
    for run, own in ((made(balls=0, step=1e-2, **rises), scene(balls={"count": 0})),
                     (at_rest(0.0, **rises), smooth)):  # fmt: skip
        assert metrics_of(run, own, ["verdict"])["verdict"] == "still changing"
    assert metrics_of(at_rest(0.0), smooth, ["verdict"])["verdict"] == "settled"


def test_the_verdict_is_monotone_where_whirl_beats_and_decays(scene: Any) -> None:
    """A slow decay under a beat: balanced once, balanced in every longer run."""
    found = []
    for length in range(1000, 4000, 100):
        run = made(
            balls=2, step=1e-2, count=length,
            ball_0_angle=lambda t: 0 * t + math.radians(119.34),
            ball_1_angle=lambda t: 0 * t - math.radians(119.34),
            x=lambda t: E * 2 * np.exp(-t / 15) * (1 + 0.4 * np.sin(2.1 * t)),
        )  # fmt: skip
        metrics = metrics_of(run, scene(), KEYS)
        found.append((metrics["balanced"], metrics["settled"]))
    balanced = [each for each, _ in found]
    assert all(balanced[balanced.index(True) :]) and not all(settled for _, settled in found)


def test_a_ball_that_circulates_balances_nothing(scene: Any) -> None:
    """A light one beside a heavy one that balances: what is left is little, and yet."""
    light = scene(balls={"mass": [9.8e-4, 1e-6]})
    round_ = made(
        balls=2, step=1e-2,
        ball_0_angle=lambda t: 0 * t - math.pi, ball_1_angle=lambda t: -30 * t,
    )  # fmt: skip
    metrics = metrics_of(round_, light, KEYS)
    assert metrics["residual_unbalance"] < 0.02
    assert metrics["balls_circulate"] is True and metrics["balanced"] is False
    still = made(balls=2, step=1e-2, ball_0_angle=lambda t: 0 * t - math.pi)
    metrics = metrics_of(still, light, KEYS)
    assert metrics["balls_circulate"] is False and metrics["balanced"] is True


def test_a_couple_counts_if_the_scene_says_so() -> None:
    """Two balls in each of two races take it away; with one in each they cannot."""
    change = "balanced.residual_couple=0.1"
    assert run_scene(load_scene("couple-unbalance", [change])).metrics.balanced is True
    lifted = ["rotor.height=0.004", "race.height=[0.006, -0.003]", "balls.race=[0, 1]"]
    for changes, balanced in (
        ([], True),
        ([change], False),
        (["balanced.residual_couple=2"], True),
    ):
        run = run_scene(load_scene("feeding-deck", [*lifted, "duration=1", *changes]))
        assert run.metrics.residual_unbalance < 0.1 < 1 < run.metrics.residual_couple < 2
        assert run.metrics.balanced is balanced


@pytest.mark.parametrize(
    ("name", "balanced"), [("balanced-start-up", True), ("thesis-hold", False), ("no-ball", False)]
)
def test_scenes_of_the_package(name: str, balanced: bool) -> None:
    assert run_scene(load_scene(name)).metrics.balanced is balanced


def test_a_scene_keeps_its_criterion_and_needs_none() -> None:
    plain = load_scene("thesis-hold")
    assert plain.balanced is None and "balanced" not in plain.as_mapping()
    own = load_scene("thesis-hold", ["balanced.residual_unbalance=0.3"])
    assert own.as_mapping()["balanced"] == {"residual_unbalance": 0.3}
    assert check_scene(own.as_mapping(), "again") == own
    with pytest.raises(ab_sim.SceneError, match="balanced.residual_unbalance = 0: must be"):
        load_scene("thesis-hold", ["balanced.residual_unbalance=0"])


def test_only_what_is_asked_for_is_looked_at(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the metric: watches of others are not even made."""
    run, asked = at_rest(119.34), scene()
    watches = set().union(*(needed(metric.accumulator) for metric in metrics_named(None)))
    made_: list[type[object]] = []
    for watch in watches:
        before: Callable[..., None] = watch.__init__  # type: ignore[misc]

        def counted(self: object, *given: Any, before: Callable[..., None] = before) -> None:
            made_.append(type(self))
            before(self, *given)

        monkeypatch.setattr(watch, "__init__", counted)
    for metric in metrics_named(None):
        made_.clear()
        metrics_of(run, asked, [metric.key])
        assert set(made_) & watches == needed(metric.accumulator) and len(made_) == len(set(made_))


def needed(watch: Any) -> set[Any]:
    return {watch}.union(*(needed(each) for each in getattr(watch, "AFTER", ())))


def test_names_are_a_list(scene: Any) -> None:
    with pytest.raises(ab_sim.InputError, match="keys = 'final_speed': "):
        ab_sim.metrics_of(made(balls=2), scene(), "final_speed")
    with pytest.raises(ab_sim.InputError, match="^trajectory: has no samples"):
        ab_sim.metrics_of(made(balls=2).last(0), scene())


def test_values_are_in_what_the_list_says(scene: Any) -> None:
    report: Mapping[str, object] = metrics_of(at_rest(119.34), scene()).report()
    for metric in metrics_named(None):
        value = report.get(metric.key)
        if value is not None and metric.scalar:
            assert isinstance(value, bool | float), metric.key


def test_the_repr_has_names_that_can_be_asked_for(scene: Any) -> None:
    """Keys, as texts; an attribute of such a name says how to write it."""
    metrics = metrics_of(at_rest(119.34), scene(), KEYS)
    shown = eval(repr(metrics).removeprefix("Metrics(").removesuffix(")"))  # noqa: S307
    assert shown == {key: metrics[key] for key in KEYS} and repr(metrics).startswith("Metrics({")
    with pytest.raises(AttributeError, match=r"write metrics\['final_whirl_over_e'\]"):
        metrics.final_whirl_over_e  # type: ignore[attr-defined]  # noqa: B018


def test_a_share_of_the_run_without_balls_is_of_run_alone(scene: Any) -> None:
    with pytest.raises(ab_sim.InputError, match="only `ab-sim run` makes; use final_whirl"):
        metrics_of(at_rest(0.0), scene(), ["final_whirl_relative_to_no_balls"])


def test_a_table_shows_whirls_as_lengths_too_and_angles_in_one_turn(scene: Any) -> None:
    """In e, and in mm or um; a ball that has gone round 26 times is shown where it is."""
    scale = Display(1 / E, "e", "W/e")
    assert final_text(0.5 * E, (E, E), True, scale) == "0.5 (50 um)"
    assert final_text(20 * E, (E, E), True, scale) == "20 (2 mm)"
    assert final_text(2e-3, (E, E), True, Display(1e3, "mm", "W")) == "2"
    assert final_text(E, (2 * E, E), False, scale) == "1 (0.1 mm), still falling (2, then 1)"
    angles = tuple(map(math.radians, (-9566.8, 142.0, 29.0, -193.0)))
    assert angles_text(angles, None) == "-206.8, -218.0, 29.0, -193.0 deg"

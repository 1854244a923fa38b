"""Metrics of curves whose metrics are known; runs beside those without balls and without period."""

import json
import math
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis import (
    Compared,
    compare_run,
    metrics_of,
    metrics_of_blocks,
    run_scene,
    without_balls,
    without_period,
)
from ab_sim.analysis.metrics import rms
from ab_sim.analysis.metrics.metric import metrics_named
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.scene import load_scene, scene_names
from tests.analysis.made import made

E = 1e-4


def whirling(whirl: Any, **channels: Any) -> Trajectory:
    """Along x, for 10 s."""
    return made(balls=2, step=1e-2, x=whirl, **channels)


def test_final_whirl_and_time_into_the_band(scene: Any) -> None:
    """W = 2 e + 50 e exp(-2 t): within a tenth of its end from t = ln(50 / 0.2) / 2 on."""
    metrics = metrics_of(whirling(lambda t: E * (2 + 50 * np.exp(-2 * t))), scene())
    assert metrics.final_whirl == pytest.approx(2 * E, rel=1e-6)
    assert metrics.band == pytest.approx(0.2 * E, rel=1e-6)
    assert metrics.in_band_from == pytest.approx(math.log(250) / 2, abs=1e-2)
    assert metrics.settled
    assert metrics.peak_whirl == pytest.approx(52 * E)


@pytest.mark.parametrize("length", [7, 100, 1001])
def test_the_band_is_entered_at_the_sample_after_the_last_one_outside(
    scene: Any, length: int
) -> None:
    """However the run is cut into pieces."""
    run = whirling(lambda t: np.where(t < 3.005, 4 * E, 2 * E))
    metrics = metrics_of_blocks(lambda: in_blocks(run, length), len(run), scene())
    assert metrics.in_band_from == run["time"][301]


def test_a_balanced_disc_has_a_band_too(scene: Any) -> None:
    """W falls to nothing: within 5 % of M0 e / M, where M0 = 98 g of M = 100 g."""
    metrics = metrics_of(whirling(lambda t: 50 * E * np.exp(-2 * t)), scene())
    assert metrics.band == pytest.approx(0.05 * 0.98 * E)
    assert metrics.in_band_from == pytest.approx(math.log(50 / 0.049) / 2, abs=1e-2)


def test_a_run_that_ends_too_soon_says_so(scene: Any) -> None:
    metrics = metrics_of(whirling(lambda t: 50 * E * np.exp(-0.3 * t)), scene())
    assert not metrics.settled and metrics.in_band_from is None
    first, second = metrics.halves
    assert second / first == pytest.approx(math.exp(-0.15), abs=1e-3)


@pytest.mark.parametrize("level", [0.1, 1.0, 100.0])
@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_whirl_that_halves_or_doubles_in_the_last_tenth_still_changes(
    scene: Any, level: float, ratio: float
) -> None:
    """With an oscillation on top, too."""
    for beat in (0.0, 0.3):
        run = whirling(lambda t, b=beat: E * level * ratio ** (t - 10) * (1 + b * np.sin(60 * t)))
        assert not metrics_of(run, scene()).settled


@pytest.mark.parametrize("periods", [1.5, 2.0, 2.5, 3.0, 3.7, 20.0])
@pytest.mark.parametrize("phase", np.linspace(0.0, 2 * math.pi, 12, endpoint=False).tolist())
def test_a_beat_is_no_trend(scene: Any, periods: float, phase: float) -> None:
    """From one and a half periods in the last tenth on, which here is a second."""
    beat = lambda t: E * (2 + np.sin(2 * math.pi * periods * t + phase))  # noqa: E731
    assert metrics_of(whirling(beat), scene()).settled


def test_a_whirl_that_keeps_varying_is_in_no_band_but_does_not_change(scene: Any) -> None:
    metrics = metrics_of(whirling(lambda t: E * (2 + np.sin(4 * math.pi * t))), scene())
    assert metrics.settled and metrics.in_band_from is None
    assert metrics.span == pytest.approx((E, 3 * E), rel=0.01)
    assert metrics.final_whirl == pytest.approx(math.sqrt(4.5) * E, rel=0.01)


def test_residual_unbalance(scene: Any) -> None:
    """2 m R / (M0 e) = 2.04: 1.04 opposite the unbalance, 0 at +-119.34 deg (EQUATIONS)."""

    def at(*degrees: float) -> float | None:
        angles = {
            f"ball_{i}_angle": lambda t, a=a: np.full_like(t, math.radians(a))
            for i, a in enumerate(degrees)
        }
        return metrics_of(made(balls=2, **angles), scene()).residual_unbalance

    ratio = 2 * 1e-3 * 0.01 / (0.098 * E)
    assert at(-180, 180) == pytest.approx(ratio - 1)
    balanced = math.degrees(math.acos(-1 / ratio))
    assert balanced == pytest.approx(119.34, abs=0.01)
    assert at(balanced, -balanced) == pytest.approx(0, abs=1e-12)
    assert metrics_of(made(balls=0), without_balls(scene())).residual_unbalance == 1.0


def test_without_an_unbalance_nothing_is_relative_to_it(scene: Any) -> None:
    metrics = metrics_of(whirling(lambda t: 0 * t), scene(rotor={"eccentricity": 0.0}))
    assert metrics.residual_unbalance is None
    report = metrics.report(0.0)
    assert report["final_whirl_over_e"] is None and report["in_band_from"] == 0.0
    json.dumps(report, allow_nan=False)


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_can_do_without_its_balls(name: str) -> None:
    scene = load_scene(name)
    alone = without_balls(scene)
    assert alone.balls.count == 0
    assert alone.eccentric_mass == scene.eccentric_mass
    assert alone.total_mass == pytest.approx(scene.total_mass - scene.balls.total_mass)
    assert len(system_of(alone).balls) == 0
    assert alone.effects == scene.effects and alone.profile == scene.planned.profile


def test_a_run_beside_others() -> None:
    """Without period thesis-hold is thesis-baseline; without balls a rotor whose whirl is known."""
    run = run_scene(load_scene("thesis-hold", ["duration=16"]))
    comparison = compare_run(run)
    through, alone = comparison.without_period, comparison.without_balls
    assert isinstance(through, Compared) and isinstance(alone, Compared)
    baseline = run_scene(load_scene("thesis-baseline", ["duration=16"]))
    assert through.whirl.tobytes() == baseline.trajectory.whirl.tobytes()
    assert through.metrics == baseline.metrics
    M, w, k, c = 0.098, 200.0, 1000.0, 0.2
    steady = M * E * w**2 / abs(k - M * w**2 + 1j * c * w)
    assert alone.metrics.final_whirl == pytest.approx(steady, rel=1e-3)
    assert comparison.relative_whirl(run.metrics) == pytest.approx(
        run.metrics.final_whirl / alone.metrics.final_whirl
    )
    json.dumps(comparison.report(run.metrics, E), allow_nan=False)


def test_who_cannot_run_is_named_and_stops_nobody() -> None:
    """Without its balls so little is left of this drive that no scene may have it."""
    changes = ["effects.suspension.stiffness=0", "effects.suspension.damping=0"]
    changes += ["rotor.total_mass=1e-8", "balls.mass=4.8e-9", "effects.rolling_friction="]
    run = run_scene(load_scene("thesis-hold", [*changes, "duration=0.1"]))
    comparison = compare_run(run)
    assert "rotor.mass" in str(comparison.without_balls)
    assert comparison.relative_whirl(run.metrics) is None
    report = comparison.report(run.metrics, E)
    assert report["without_balls"] == {"failure": comparison.without_balls}
    assert report["without_variable_speed_period"]["peak_whirl_over_e"] > 0


def test_the_demo_gets_balanced_by_its_balls_and_its_period() -> None:
    """Without balls 1.34 e; with them but without the hold more than half of that; with it, 8 %."""
    run = run_scene(load_scene("balanced-start-up"))
    comparison = compare_run(run)
    through = comparison.without_period
    assert isinstance(through, Compared)
    share, through_share = (comparison.relative_whirl(m) for m in (run.metrics, through.metrics))
    assert share is not None and share < 0.1
    assert through_share is not None and through_share > 0.5
    assert run.metrics.in_band_from is not None and run.metrics.settled
    assert run.metrics.first_passage_of_opposite is None, "which says nothing of balance"


def test_the_demo_is_no_lucky_start() -> None:
    """From ten starts at random: the worst with the hold is better than the median without."""
    random = np.random.default_rng(1)
    scene = load_scene("balanced-start-up")
    ends: dict[bool, list[float]] = {True: [], False: []}
    for angles in random.uniform(-math.pi, math.pi, (10, 2)).tolist():
        for hold in ends:
            start = scene.start.model_copy(update={"ball_angles": tuple(angles)})
            one = scene.model_copy(update={"start": start})
            end = run_scene(one if hold else without_period(one)).metrics.final_whirl
            ends[hold].append(end / E)
    assert np.median(ends[True]) < 0.3 < 0.6 < np.median(ends[False])
    assert np.max(ends[True]) < np.median(ends[False])


def in_blocks(run: Trajectory, size: int) -> Any:
    for first in range(0, len(run), size):
        yield Trajectory(run.channels, run.samples[first : first + size])


@pytest.mark.parametrize("size", [1, 2, 3, 5, 1001])
@pytest.mark.parametrize("at", [3.001, 3.0049, 3.005, 3.0051, 3.009])
def test_the_peak_is_found_between_samples_wherever_pieces_end(
    scene: Any, at: float, size: int
) -> None:
    """W = e (3 - 2000 (t - at)^2): a parabola, which velocities tell from its samples."""
    run = whirling(
        lambda t: E * (3 - np.minimum(2000 * (t - at) ** 2, 2)),
        vx=lambda t: np.where(abs(t - at) < 0.03, -4000 * E * (t - at), 0.0),
    )
    metrics = metrics_of_blocks(lambda: in_blocks(run, size), len(run), scene())
    assert metrics.peak_whirl == pytest.approx(3 * E, rel=1e-12)
    assert metrics.peak_time == pytest.approx(at, abs=1e-6)


@pytest.mark.parametrize("size", [1, 3, 1001])
def test_what_a_run_ends_with_is_that_of_its_last_sample(scene: Any, size: int) -> None:
    """And the passage of the balls at -180 deg is the first one, of a start-up only."""
    run = whirling(
        lambda t: E * t,
        ball_0_angle=lambda t: -t,
        ball_1_angle=lambda t: -1.1 * t,
        ball_0_rate=lambda t: -1.0 + 0 * t,
        ball_1_rate=lambda t: -1.1 + 0 * t,
        speed=lambda t: 30.0 + t,
    )
    metrics = metrics_of_blocks(lambda: in_blocks(run, size), len(run), scene())
    assert metrics.final_ball_angles == pytest.approx((-10.0, -11.0))
    assert metrics.final_speed == pytest.approx(40.0)
    assert metrics.first_passage_of_opposite == pytest.approx(math.pi, abs=1e-9)
    change = {"kind": "speed_change", "to_speed": 300.0, "start_time": 0.1, "duration": 1.0}
    held = scene(profile=None), scene(profile=change)
    assert [metrics_of(run, other).first_passage_of_opposite for other in held] == [None, None]


@pytest.mark.parametrize(
    ("count", "halves"),
    [(1, (0, 0)), (10, (9, 9)), (20, (18, 19)), (30, (math.hypot(27, 28) / 2**0.5, 29))],
)
def test_a_short_run_has_a_last_stretch_too(scene: Any, count: int, halves: Any) -> None:
    """A tenth of the samples, at least one; the middle one of an odd number is in the first."""
    run = made(balls=2, step=1.0, count=count, x=lambda t: E * t)
    for size in (1, count):
        metrics = metrics_of_blocks(lambda size=size: in_blocks(run, size), count, scene())
        assert metrics.halves == pytest.approx((E * halves[0], E * halves[1]))
        last = E * np.arange(count)[-max(1, count // 10) :]
        assert metrics.final_whirl == pytest.approx(math.sqrt(np.mean(last**2)))
        assert metrics.span == pytest.approx((last.min(), last.max()))


@pytest.mark.parametrize(("enters", "found"), [(90, 90.0), (99, None)])
def test_the_band_may_be_entered_at_the_last_stretch_and_no_later(
    scene: Any, enters: int, found: float | None
) -> None:
    run = made(balls=2, step=1.0, count=100, x=lambda t: np.where(t < enters, 2 * E, E))
    assert metrics_of(run, scene()).in_band_from == found


def test_a_report_counts_whirl_in_eccentricities(scene: Any) -> None:
    metrics = metrics_of(whirling(lambda t: E * (2 + 50 * np.exp(-2 * t))), scene())
    report = metrics.report(E)
    for name in ("peak_whirl", "final_whirl", "band"):
        assert report[f"{name}_over_e"] == getattr(metrics, name) / E


def test_a_report_names_balls_that_overlap(scene: Any) -> None:
    apart = scene(
        effects={"ball_contact": {"restitution_coefficient": 0.5}},
        start={"ball_angles": [0.0, 1.0]},
    )
    run = made(balls=2, ball_1_angle=lambda t: 1.0 - t)
    assert metrics_of(run, apart).report(E)["overlapping_balls"] is None
    (overlap,) = metrics_of(run, scene()).report(E)["overlapping_balls"]
    assert overlap["balls"] == (0, 1)
    assert overlap["since"] == pytest.approx(1.0 - 2 * math.asin(0.1), abs=1e-3)


def test_root_mean_square() -> None:
    assert rms(np.array([1.0, -7.0, 5.0, 5.0])) == 5.0


@pytest.mark.parametrize("size", [1, 2, 7, 100, 999])
@pytest.mark.parametrize(
    "whirl",
    [
        lambda t: E * (2 + 50 * np.exp(-2 * t)),
        lambda t: E * (2 + np.sin(40 * t) * np.exp(-((t - 5) ** 2))),
        lambda t: E * (1 + t),
        lambda t: 0 * t,
    ],
)
def test_piece_by_piece_is_the_same(size: int, whirl: Any, scene: Any) -> None:
    """Sums are rounded in another order; what is found at a sample is the same to the bit."""
    run = whirling(whirl, ball_0_angle=lambda t: -t, ball_1_angle=lambda t: -0.9 * t)
    pieced = metrics_of_blocks(lambda: in_blocks(run, size), len(run), scene())
    whole = metrics_of(run, scene())
    for metric in metrics_named(None):
        one, other = whole.of(metric), pieced.of(metric)
        assert one == other or other == pytest.approx(one, rel=1e-12), metric.key
    assert whole.peak_whirl == pieced.peak_whirl and whole.peak_time == pieced.peak_time
    assert whole.in_band_from == pieced.in_band_from
    assert whole.first_passage_of_opposite == pieced.first_passage_of_opposite

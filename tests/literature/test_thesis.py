"""The thesis' start-ups: published values beside ours.

Source: Yoshida (2014), chapters 4 and 5; check values in EQUATIONS.md, "Check values, thesis".
Mapping: theta in the thesis' degrees, unwrapped, from the unbalance; t = 0 at standstill; "2.5 s
after the critical speed" is t = 5 s, with the variable-speed period too.

Tolerances:
- *computed*: our own values, independently computed; 0.1 %.
- *published*: read off the thesis' figures and text. "about 55" and the like carry half a unit of
  the last digit that is given at least; angles are read to some 10 deg. Its settling
  periods are printed to 0.01 s but ours differ from them by up to 0.054 s: ball angles near -180
  deg move slowly, so the instant of reaching it is ill-conditioned. Both are stated, neither is
  tuned.
"""

from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.analysis import (
    OfflineRun,
    driving_forces,
    first_passage_of_opposite,
    peak_whirl,
    run_scene,
)
from ab_sim.scene import load_scene

OURS = 1e-3
E = 1e-4


def run(scene: str, *changes: str) -> OfflineRun:
    return run_scene(load_scene(scene, changes), times=[5.0])


def angles_at_5_s(result: OfflineRun) -> np.ndarray:
    return np.degrees(result.samples[0].theta)


class Peak(NamedTuple):
    scene: str
    computed: float
    at: float
    published: float
    published_at: float


@pytest.mark.parametrize(
    "case",
    [
        Peak("thesis-baseline", 54.56, 2.866, published=55, published_at=2.8),
        Peak("thesis-hold", 62.53, 3.297, published=62, published_at=3.3),
        Peak("thesis-half-acceleration", 60.05, 3.016, published=62, published_at=3.0),
    ],
    ids=lambda case: case.scene,
)
def test_peak_whirl(case: Peak) -> None:
    peak, at = peak_whirl(run(case.scene).trajectory)
    assert peak / E == pytest.approx(case.computed, rel=OURS)
    assert at == pytest.approx(case.at, rel=OURS)
    # "almost the same as" the hold's 62 is all that is said of the half acceleration.
    assert peak / E == pytest.approx(case.published, abs=2.0)
    assert at == pytest.approx(case.published_at, abs=0.1)


@pytest.mark.parametrize(
    ("scene", "start", "computed", "published"),
    [
        ("thesis-baseline", (0, 0), (-153.2, -153.2), (-150, -150)),
        ("thesis-hold", (0, 0), (-198.3, -198.3), (-200, -200)),
        ("thesis-hold", (45, -45), (-190.5, -202.8), (-180, -180)),
        # Published: "one of the two balls ... about -180 degrees, but another ball is not".
        ("thesis-baseline", (45, -45), (-190.1, -48.9), (-180, None)),
    ],
)
def test_angles_from_start_positions(scene: str, start: Any, computed: Any, published: Any) -> None:
    got = angles_at_5_s(run(scene, f"start.ball_angles={np.radians(start).tolist()}"))
    if scene == "thesis-baseline":
        # Which of the two balls gets there is not said.
        got = np.sort(got)
    np.testing.assert_allclose(got, computed, rtol=OURS, atol=0.05)
    for value, figure in zip(got, published, strict=True):
        if figure is None:
            assert abs(value + 180) > 90
        else:
            assert value == pytest.approx(figure, abs=25)


@pytest.mark.parametrize(
    ("scene", "duration", "computed", "published"),
    [
        ("thesis-hold", 0.4, 0.799, 0.77),
        ("thesis-hold", 0.5, 0.873, 0.86),
        ("thesis-hold", 0.6, 0.952, 0.91),
        ("thesis-half-acceleration", 0.5, 0.633, 0.58),
        ("thesis-half-acceleration", 0.6, 0.629, 0.59),
    ],
)
def test_first_passage_of_opposite(
    scene: str, duration: float, computed: float, published: float
) -> None:
    """The thesis' "settling period": counted from the start of the variable-speed period."""
    result = run(scene, f"profile.variable_speed_period.duration={duration}")
    assert result.variable_speed_period == 2.5
    passed = first_passage_of_opposite(result.trajectory)
    assert passed is not None
    assert passed - 2.5 == pytest.approx(computed, abs=0.5e-3 + OURS * computed)
    assert passed - 2.5 == pytest.approx(published, abs=0.054)


@pytest.mark.parametrize(
    ("scene", "drag", "computed", "published"),
    [
        ("thesis-baseline", 1, -621.7, -600),
        ("thesis-baseline", 2, -205.3, -200),
        ("thesis-hold", 1, -841.6, -900),
        ("thesis-hold", 2, -294.0, -300),
    ],
)
def test_heavier_balls(scene: str, drag: float, computed: float, published: float) -> None:
    """m = 2 g, without and with more drag: section 5. -900 is what they are "heading toward"."""
    result = run(scene, "balls.mass=0.002", f"effects.viscous_drag.coefficient={drag}")
    got = angles_at_5_s(result)
    np.testing.assert_allclose(got, computed, rtol=OURS)
    assert got[0] == pytest.approx(published, abs=60)


@pytest.mark.parametrize(
    ("scene", "start", "computed", "published"),
    [
        ("thesis-baseline", (0, 0), 0.0603, 0.06),
        ("thesis-hold", (0, 0), 0.0721, 0.07),
        ("thesis-hold", (45, -45), 0.0725, 0.07),
        ("thesis-hold", (45, 90), 0.0814, 0.08),
    ],
)
def test_forward_peak_of_the_driving_force(
    scene: str, start: Any, computed: float, published: float
) -> None:
    """Sections 4.1, 4.2, to the digit printed; the unsigned print would reach .089 and more."""
    loaded = load_scene(scene, [f"start.ball_angles={np.radians(start).tolist()}"])
    force = driving_forces(run_scene(loaded).trajectory, loaded)
    assert force.max() == pytest.approx(computed, rel=2e-3)
    assert force.max() == pytest.approx(published, abs=0.005)


def test_minus_180_is_not_balance_for_the_thesis_set() -> None:
    """EQUATIONS.md: with 2 m R / (M0 e) = 2.04 the hold leaves the larger whirl at 200 rad/s.

    7.7 without and 10.2 with it; both digits are ours, to the half of the last one.
    """
    without = run_scene(load_scene("thesis-baseline", ["profile.target_speed=400"]), times=[5.0])
    with_hold = run_scene(load_scene("thesis-hold", ["profile.target_speed=400"]), times=[5.5])
    assert without.samples[0].omega == with_hold.samples[0].omega == pytest.approx(200)
    assert without.samples[0].whirl / E == pytest.approx(7.7, abs=0.05)
    assert with_hold.samples[0].whirl / E == pytest.approx(10.2, abs=0.05)


def test_the_first_passage_is_soonest_in_the_worst_of_four_designs() -> None:
    """Of balls of 0.5, 1, 2 and 3 g: that is why runs are judged by their final whirl."""
    runs = [
        run_scene(load_scene("thesis-hold", [f"balls.mass={mass}", "duration=14"])).metrics
        for mass in (0.5e-3, 1e-3, 2e-3, 3e-3)
    ]
    passages = [one.first_passage_of_opposite or np.inf for one in runs]
    whirls = [one.final_whirl / E for one in runs]
    assert np.argmin(passages) == np.argmax(whirls) == 3
    # With equal masses, 4/3 without balls: M0 e w^2 / (M w^2 - k) at twice the critical speed.
    assert whirls[3] > 4 * 4 / 3 and whirls[0] < 4 / 3 / 4

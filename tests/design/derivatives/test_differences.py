"""Derivatives of functions that are known, smooth or not, and their uncertainties."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from ab_sim.design.differences import DerivativeEstimate, differentiated, real_key
from ab_sim.scene.load import load_scene
from ab_sim.scene.model import Scene

SCENE = load_scene("thesis-hold", ["start.ball_angles=[0.3, 1.2]"])


def estimate(
    function: Callable[[float], float], key: str = "start.ball_angles.0", scene: Scene = SCENE
) -> DerivativeEstimate:
    """Derivative of a function of the scene's value, in place of a run."""

    def results(scenes: Sequence[Scene]) -> np.ndarray:
        return np.array([[[function(real_key(each, key).value)]] for each in scenes])

    return differentiated(scene, [real_key(scene, key)], results([scene])[0], results)


def jitter(x: float) -> float:
    """Evenly between -1 and 1, and another one for each x."""
    return float(np.random.default_rng(np.float64(x).view(np.uint64)).uniform(-1.0, 1.0))


@pytest.mark.parametrize(
    ("function", "slope"),
    [
        (np.sin, np.cos(0.3)),
        (lambda x: 1.0, 0.0),
        (lambda x: np.sin(300.0 * x), 300.0 * np.cos(90.0)),
        (lambda x: 5.0 + x + 1e-8 * jitter(x), 1.0),
        (lambda x: 1e-5 * jitter(x), 0.0),
        (lambda x: np.exp(x) if x < 0.3005 else 7.0, np.exp(0.3)),
    ],
    ids=["smooth", "constant", "curved", "rough", "noise alone", "jump nearby"],
)
def test_the_uncertainty_covers_the_error(function: Callable[[float], float], slope: float) -> None:
    found = estimate(function)
    assert abs(found.derivatives[0, 0, 0] - slope) <= found.uncertainties[0, 0, 0]


def test_smooth_derivatives_are_certain() -> None:
    assert estimate(np.sin).uncertainties[0, 0, 0] < 1e-8
    assert 1e-8 < estimate(lambda x: x + 1e-8 * jitter(x)).uncertainties[0, 0, 0] < 1e-3


def test_both_slopes_at_a_kink_are_within_the_uncertainty() -> None:
    found = estimate(lambda x: 2.0 * x if x > 0.3 else 0.6 - (0.3 - x))
    assert found.derivatives[0, 0, 0] == pytest.approx(1.5)
    assert found.uncertainties[0, 0, 0] >= 0.5 * (1.0 - 1e-9)


def test_a_jump_leaves_no_derivative() -> None:
    found = estimate(lambda x: 1.0 if x > 0.3 else 0.0)
    assert found.uncertainties[0, 0, 0] > abs(found.derivatives[0, 0, 0]) / 2.0 > 10.0


def test_at_the_end_of_its_range_a_key_moves_to_one_side() -> None:
    key = "effects.ball_contact.restitution_coefficient"
    scene = load_scene("on-edge", [f"{key}=0.0"])
    found = estimate(lambda x: np.exp(3.0 * x), key, scene)
    assert abs(found.derivatives[0, 0, 0] - 3.0) <= found.uncertainties[0, 0, 0] < 0.1


def test_where_one_side_fails_there_is_no_derivative() -> None:
    """The key could be there: it is no end of its range."""
    found = estimate(lambda x: x if x < 0.3 + 1e-7 else np.nan)
    assert np.isinf(found.uncertainties[0, 0, 0])


def test_where_even_the_nearest_runs_fail_there_is_none() -> None:
    found = estimate(lambda x: x if x <= 0.3 else np.nan)
    assert np.isinf(found.uncertainties[0, 0, 0])


def test_rounding_is_measured_at_the_upper_end_of_a_key_s_range() -> None:
    key, end = "start.speed", load_scene("nsc-case-1")
    top = real_key(end, key).value
    assert top == end.spindle.max_speed
    found = estimate(lambda x: x + 1e-6 * jitter(x), key, end)
    error = abs(found.derivatives[0, 0, 0] - 1.0)
    assert error <= found.uncertainties[0, 0, 0] and found.uncertainties[0, 0, 0] > 1e-9

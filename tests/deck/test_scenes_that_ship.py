"""What the scenes of decks in space say of themselves is so."""

import math

import numpy as np
import pytest

from ab_sim.analysis import without_balls
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import Scene, load_scene


def run_of(scene: Scene) -> Trajectory:
    return Drive(scene).advance(round(scene.duration / scene.solver.step))


def final_tilt(run: Trajectory) -> float:
    """Angle between the shaft and Z, root mean square of the last second [rad]."""
    last = run["time"] > run["time"][-1] - 1.0
    # The third column of the turn is (2 (xz + wy), 2 (yz - wx), 1 - 2 (x^2 + y^2)).
    half = np.hypot(run["qx"], run["qy"])[last]
    return float(2.0 * np.sqrt(np.mean(np.arcsin(half) ** 2)))


def to_the_unbalance(angles: np.ndarray) -> np.ndarray:
    """Each ball's angle from the unbalance, whichever way round, in degrees."""
    return np.abs(np.degrees(np.angle(np.exp(1j * angles))))


def test_the_feeding_deck_s_balls_balance_it() -> None:
    """+-142.3 deg of EQUATIONS.md section 4: 2 m R cos theta = -M eps."""
    run = run_of(load_scene("feeding-deck"))
    balanced = math.degrees(math.acos(-0.03 * 3.16489e-4 / (2 * 2e-4 * 0.03)))
    assert balanced == pytest.approx(142.3, abs=0.05)
    at = run["time"] >= 2.0
    angles = to_the_unbalance(run.ball_angles[at])
    np.testing.assert_allclose(angles, balanced, rtol=0.0, atol=0.01)
    assert run.ball_angles[-1].prod() < 0, "one on each side"
    assert run.whirl[-1] < 1e-10
    assert not run["qx"].any() and not run["qy"].any(), "with all heights 0 nothing tilts"


COUPLE = "couple-unbalance"


def test_one_plane_cannot_balance_a_couple_and_two_can() -> None:
    scene = load_scene(COUPLE)
    two, one = run_of(scene), run_of(load_scene(COUPLE, ["balls.race=0"]))
    none = final_tilt(run_of(without_balls(scene)))
    # Forward tilt of the symmetric deck: J_t z'' + (c_t - i J_p w) z' + k_t z = xz w^2 exp(i w t).
    w, lever = 500.0, 4 * 0.06**2
    J_t, J_p = 1.2e-4 + 9e-6, 1.35e-5
    expected = 4.5e-8 * w**2 / abs(1063.1 * lever - (J_t - J_p) * w**2 + 0.6j * lever * w)
    assert none == pytest.approx(expected, rel=1e-3)
    assert final_tilt(one) > 0.8 * none
    assert final_tilt(two) < 2e-3 * none
    # m R (above + below) = -M0 e, m R h (above - below) = xz, of sums of cosines.
    both, apart = -0.03 * 1e-5 / (5e-5 * 0.03), 4.5e-8 / (5e-5 * 0.03 * 0.01)
    above, below = (both + apart) / 4, (both - apart) / 4
    want = np.degrees(np.arccos([above, above, below, below]))
    np.testing.assert_allclose(to_the_unbalance(two.ball_angles[-1]), want, rtol=0.0, atol=0.1)
    assert want[0] < 90.0 < want[2], "to opposite sides"
    assert two.whirl[-1] < 1e-3 * 1e-5, "the little static unbalance is balanced along with it"


def test_below_the_critical_speeds_two_planes_make_it_worse() -> None:
    changed = load_scene(COUPLE, ["profile.target_speed=300"])
    assert final_tilt(run_of(changed)) > 1.5 * final_tilt(run_of(without_balls(changed)))

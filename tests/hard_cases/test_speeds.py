"""Speed commands of any size, sign reversal, 20,000 rpm, dwelling at and creeping past resonance.

A command that jumps leaves a kink in the speed that a fixed step averages over, first order from
there on; 20,000 rpm puts the whirl's rate in the rotating frame at 2,000 1/s; at the critical
speed the whirl grows for as long as one waits. Asserted: energy balances, the speed ends where it
was told to, dwelling agrees with the independent simulator, and halving the step changes nothing.
"""

import numpy as np
import pytest

from tests.hard_cases.extremes import APART, errors, fast, imbalance, run, scene_of

LIMITS = {"max_speed": 2500.0, "max_acceleration": 1e5}
TOP = 20000 * 2 * np.pi / 60


def commanded(step: float, speeds: tuple[float, ...]) -> tuple[np.ndarray, float]:
    drive = run(fast(spindle=LIMITS, solver={"step": step}), 0.05)
    for speed in speeds:
        drive.command(speed)
        assert np.isfinite(drive.advance(round(0.05 / step)).samples).all()
        assert drive.observe().omega == pytest.approx(speed, abs=1e-12)
    return np.append(drive.observe().theta, 100 * drive.observe().u), imbalance(drive)


@pytest.mark.parametrize(
    "speeds", [(1e-9, 119.0), (-120.0, 120.0, 0.0), (TOP, -TOP), (5e-324, -5e-324)]
)
def test_command_steps(speeds: tuple[float, ...]) -> None:
    coarse, open_1 = commanded(2e-4, speeds)
    fine, open_2 = commanded(1e-4, speeds)
    assert max(open_1, open_2) < 1e-9
    np.testing.assert_allclose(coarse, fine, atol=1e-8)


def test_dwelling_exactly_at_the_critical_speed() -> None:
    critical = scene_of().critical_speed
    assert critical is not None
    scene = fast(start={"speed": critical})
    balls, deck = errors(run(scene, 0.3))
    assert balls < 1e-9 and deck < 1e-9
    assert imbalance(run(scene, 60.0)) < 1e-9


def test_creeping_through_resonance() -> None:
    """At a hundredth of the nominal acceleration: 0.4 rad/s^2, from 90 to 110 rad/s."""
    profile = {"kind": "start_up", "acceleration": 0.4, "target_speed": 110.0}
    start = {"speed": 90.0, "ball_angles": list(APART)}
    slow = [
        run(scene_of(profile=profile, start=start, solver={"step": h}), 52.0) for h in (1e-3, 5e-4)
    ]
    assert max(map(imbalance, slow)) < 1e-9
    np.testing.assert_allclose(slow[0].observe().theta, slow[1].observe().theta, atol=1e-6)

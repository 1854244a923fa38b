"""No damping, no drag: energy has nowhere to go, and a stepper's own damping shows.

A dissipative method makes an undamped drive settle, an unstable one makes it grow, slowly enough
to be believed. Asserted: over 20,000 revolutions the energy balance's residual stays below 1e-8 of
the energy; half the step leaves a fiftieth of it or less, as order 8 should, until rounding shows.
"""

from ab_sim.drive import Drive
from tests.hard_cases.extremes import imbalance, scene_of


def undamped(step: float) -> Drive:
    return Drive(
        scene_of(
            effects={"suspension": {"damping": 0.0}, "viscous_drag": {"coefficient": 0.0}},
            start={"speed": 200.0, "ball_angles": [0.3, -0.9]},
            profile=None,
            solver={"stepper": "rk8", "step": step},
        ),
        energy_balance=True,
    )


def drift(step: float, revolutions: int) -> float:
    drive = undamped(step)
    for _ in range(10):
        drive.advance(round(0.1 * revolutions * 0.0314159 / step))
    assert drive.observe().psi > 6.28 * revolutions
    assert drive.energy().dissipated == 0.0
    return imbalance(drive)


def test_energy_does_not_drift() -> None:
    assert drift(1e-3, 20_000) < 1e-8


def test_half_the_step_drifts_less() -> None:
    coarse, fine = drift(2e-3, 1000), drift(1e-3, 1000)
    assert coarse > 1e-9, "more than rounding"
    assert fine < coarse / 50

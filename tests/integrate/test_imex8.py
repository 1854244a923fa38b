"""Stiff drag by imex8, and steps divided into parts."""

from typing import Any

import numpy as np
import pytest

from ab_sim.design.batch import simulate_batch
from ab_sim.drive import Drive
from ab_sim.engine.integrate.registry import stepper_named
from ab_sim.engine.integrate.steppers.imex8 import METHOD, growth
from ab_sim.scene import Scene

STICKING = {"rolling_friction": {"arm": 1e-5}, "viscous_drag": {"coefficient": 100.0}}
STIFF_MOUNTS = {"suspension": {"stiffness": 1e8, "damping": 0.2}}


def stiff(scene: Any, effects: dict[str, Any], **solver: Any) -> Scene:
    """Return the thesis' drive at 60 rad/s with two balls apart."""
    made: Scene = scene(
        profile=None,
        start={"speed": 60.0, "ball_angles": [0.3, -0.9]},
        effects=effects,
        solver={"stepper": "auto", "step": 1e-3} | solver,
        duration=0.3,
    )
    return made


def test_weights_extrapolate_polynomials_in_the_inverse_of_the_number_of_parts() -> None:
    inverse = 1.0 / np.array(METHOD.divisions)
    for power in range(len(METHOD.divisions)):
        expected = 1.0 if power == 0 else 0.0
        assert np.dot(METHOD.weights, inverse**power) == pytest.approx(expected, abs=1e-10)


def test_growth_is_the_exponential_up_to_order_8() -> None:
    errors = [abs(growth(z) - np.exp(z)) for z in (0.2j, 0.4j)]
    assert np.log2(errors[1] / errors[0]) == pytest.approx(9.0, abs=0.3)


def test_sticking_balls_with_stiff_drag_agree_with_rk8_at_short_steps(scene: Any) -> None:
    coarse = Drive(stiff(scene, STICKING))
    fine = Drive(stiff(scene, STICKING, stepper="rk8", step=2e-5))
    assert coarse.stepper.name == "imex8"
    run, same = coarse.advance(300), fine.advance(15_000, every=50)
    assert np.abs(run.ball_angles - same.ball_angles).max() < 1e-8
    assert np.abs(run.position - same.position).max() < 1e-11
    assert np.ptp(run.ball_angles[:, 0]) > 1e-5, "balls slide before they stick"


@pytest.mark.parametrize(
    ("effects", "name", "parts"),
    [(STICKING, "imex8", 1), (STIFF_MOUNTS, "rk8", None)],
    ids=["stiff drag with friction", "stiff mounts"],
)
class TestAutomatic:
    """Steps that ``auto`` takes where ``rk8`` is unstable."""

    def test_choice(self, scene: Any, effects: Any, name: str, parts: int | None) -> None:
        choice = Drive(stiff(scene, effects)).choice
        stepper = choice.stepper
        assert (f"in {stepper.parts} parts" in choice.reason) == (name == "rk8")
        assert stepper.name == name
        assert stepper.parts == parts if parts else stepper.parts > 1

    def test_runs_in_lanes_have_the_bits_of_single_runs(
        self, scene: Any, effects: Any, name: str, parts: int | None
    ) -> None:
        variations = [{"balls.mass": 1e-3 * (1.0 + 0.01 * k)} for k in range(9)]
        batch = simulate_batch(stiff(scene, effects), variations)
        assert batch.in_lanes == 9
        for run in batch.runs:
            alone = Drive(run.scene).advance(300)
            assert run.trajectory.samples.tobytes() == alone.samples.tobytes()

    def test_commands_and_snapshots(
        self, scene: Any, effects: Any, name: str, parts: int | None
    ) -> None:
        drive = Drive(stiff(scene, effects), commanded=True)
        drive.advance(50)
        drive.command(70.0)
        kept = drive.snapshot()
        run = drive.advance(100)
        other = Drive(stiff(scene, effects), commanded=True)
        other.restore(kept)
        assert other.advance(100).samples.tobytes() == run.samples.tobytes()
        assert run["speed"][-1] > 60.0


def test_parts_of_a_step_follow_stiff_mounts(scene: Any) -> None:
    rk8 = stepper_named("rk8")
    assert rk8.in_parts(1) is rk8 and rk8.in_parts(3) is rk8.in_parts(3)
    parted = Drive(stiff(scene, STIFF_MOUNTS)).advance(300)
    fine = Drive(stiff(scene, STIFF_MOUNTS, stepper="rk8", step=1e-5)).advance(30_000, every=100)
    assert np.abs(parted.ball_angles - fine.ball_angles).max() < 1e-9

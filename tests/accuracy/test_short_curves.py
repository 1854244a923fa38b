"""A change of speed along a curve shorter than the steps: against an independent simulator.

Without the balls' spin these are the effects of the NSC scenes, whose kernels are there anyway.
"""

import functools
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.drive.accuracy.live_checks import LiveChecks
from ab_sim.scene import Scene, check_scene
from tests.conftest import THESIS, merge
from tests.reference import simulate
from tests.reference.of_scene import params_of

GRID = 0.01
STIFF, SLIPPERY = 1.0, 0.005
"""Drag [N s/m]: with the second the balls remember each error."""


def changing(drag: float, duration: float, start: float = 0.1, **changes: Any) -> Scene:
    """From 100 to 300 rad/s within ``duration`` [s]."""
    made = merge(
        THESIS,
        {
            "balls": {"radius": None},
            "effects": {"viscous_drag": {"coefficient": drag}, "ball_spin": None},
            "start": {"speed": 100.0, "ball_angles": [0.2, -0.7]},
            "profile": {
                "kind": "speed_change", "start_time": start, "duration": duration, "to_speed": 300.0
            },
            "duration": 0.3,
        },
    )  # fmt: skip
    return check_scene(merge(made, changes), "test")


@functools.cache
def truth(drag: float, duration: float, start: float) -> np.ndarray:
    """Ball angles [rad] at whole multiples of ``GRID``."""
    scene = changing(drag, duration, start)
    times = GRID * np.arange(1, round(scene.duration / GRID) + 1)
    return simulate(params_of(scene), scene.start.ball_angles, times, rtol=2e-13).theta


def error(scene: Scene, want: np.ndarray) -> float:
    """Of a scene's run [rad]."""
    every = round(GRID / scene.solver.step)
    run = Drive(scene).advance(every * len(want))
    return float(np.abs(run.ball_angles[every - 1 :: every] - want).max())


@pytest.mark.parametrize(
    ("drag", "duration", "start"),
    [
        # At once: later on, SciPy's own times are too coarse for a microsecond.
        (SLIPPERY, 1e-6, 0.0),
        (SLIPPERY, 1e-5, 0.1),
        (SLIPPERY, 1e-4, 0.1003),
        (SLIPPERY, 1e-3, 0.1),
        (STIFF, 1e-3, 0.1),
    ],
)
def test_the_error_asked_for_is_met(drag: float, duration: float, start: float) -> None:
    scene = changing(drag, duration, start, solver=None, accuracy={"angle": 1e-9})
    scene, work_precision = resolve_accuracy(scene)
    assert work_precision is not None
    found = error(scene, truth(drag, duration, start))
    assert work_precision.measured.angle <= 2.5e-10 and found <= 5e-10, work_precision.reason


def test_a_refusal_is_true() -> None:
    """Beyond double precision, here: with such steps and shorter ones, errors are rounding's."""
    with pytest.raises(SceneError, match="rounding errors") as caught:
        resolve_accuracy(changing(SLIPPERY, 1e-3, solver=None, accuracy={"angle": 1e-14}))
    best = float(str(caught.value).split(" is about ")[1].split()[0])
    assert best < 1e-8, "and so they are small"


@pytest.mark.parametrize(("stepper", "step", "most"), [("rk4", 1e-3, 1e-3), ("rk8", 2e-3, 1e-9)])
def test_errors_fall_with_the_step(stepper: str, step: float, most: float) -> None:
    want = truth(SLIPPERY, 1e-4, 0.1003)
    long, short = (
        error(changing(SLIPPERY, 1e-4, 0.1003, solver={"stepper": stepper, "step": each}), want)
        for each in (step, step / 2)
    )
    assert short < most and short < long / 12, "half the step halves the steps along the curve"


def test_the_live_estimate_sees_it() -> None:
    """Its run again at half the step takes the curve in steps of half the length."""
    scene = changing(SLIPPERY, 1e-4, 0.1003, solver={"stepper": "rk4", "step": 1e-3})
    checks = LiveChecks(Drive(scene), 0.5)
    run = checks.advance(120)
    checks.check(10**6)
    true = np.abs(run.ball_angles[9::10] - truth(SLIPPERY, 1e-4, 0.1003)[:12]).max()
    assert 0.5 * true <= checks.largest.angle <= 1.3 * true


def test_any_grouping_and_snapshots_within_the_curve() -> None:
    scene = changing(SLIPPERY, 3.7e-3, 0.1003, solver={"stepper": "rk4", "step": 1e-3})
    whole, single, again = Drive(scene), Drive(scene), Drive(scene)
    want = whole.advance(110).samples
    got = np.concatenate([single.advance(1).samples for _ in range(110)])
    assert got.tobytes() == want.tobytes()
    again.advance(102)
    kept = again.snapshot()
    again.advance(5)
    again.restore(kept)
    assert again.advance(8).samples.tobytes() == want[102:].tobytes()


def test_observing_between_steps_resolves_it_as_well() -> None:
    coarse, fine = (
        Drive(changing(STIFF, 1e-4, 0.1003, solver={"stepper": "rk8", "step": step}))
        for step in (1e-3, 5e-5)
    )
    coarse.advance(100)
    fine.advance(2007)
    np.testing.assert_allclose(coarse.observe_at(0.10035).theta, fine.observe().theta, rtol=1e-11)

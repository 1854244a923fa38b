"""What comes once per turn: size and phase, of runs whose answer is known."""

import math
import pickle
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis import metrics_of, run_scene
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.turn_vector import TurnVector, once_per_turn
from ab_sim.scene import load_scene
from tests.analysis.made import made

E = 1e-4


def circling(phase: float, speed: float, **more: Any) -> Trajectory:
    """The shaft circles at 2 e, a phase ahead of the unbalance, and at 3 e at another rate."""
    psi = lambda t: 0.7 + speed * t  # noqa: E731
    other = lambda t: 0.41 * speed * t  # noqa: E731
    return made(
        balls=0, step=1e-3, count=4001, angle=psi, speed=lambda t: 0 * t + speed,
        x=lambda t: E * (2 * np.cos(psi(t) + phase) + 3 * np.cos(other(t))),
        y=lambda t: E * (2 * np.sin(psi(t) + phase) + 3 * np.sin(other(t))), **more,
    )  # fmt: skip


@pytest.mark.parametrize("speed", [200.0, -200.0])
@pytest.mark.parametrize("phase", [-2.5, 0.0, 0.3, 3.0])
def test_the_metric_is_the_phase_that_was_put_in(scene: Any, phase: float, speed: float) -> None:
    metrics = metrics_of(circling(phase, speed), scene(balls={"count": 0}))
    assert metrics["once_per_turn_over_e"] == pytest.approx(2.0, rel=3e-3)
    assert metrics["phase"] == pytest.approx(phase, abs=3e-3)


def test_a_turn_that_is_not_there_has_no_phase(scene: Any) -> None:
    """Two turns at least, in the last stretch of 0.4 s; and samples within a quarter of a turn."""
    bare = scene(balls={"count": 0})
    for speed, known in ((30.0, False), (40.0, True), (1500.0, True), (1600.0, False)):
        metrics = metrics_of(circling(0.3, speed), bare)
        assert (metrics["phase"] is not None) is known, speed
    still = metrics_of(made(balls=0, angle=lambda t: 200 * t), bare)
    assert still["once_per_turn_over_e"] == 0.0 and still["phase"] is None


@pytest.mark.parametrize("length", [1, 7, 100, 4001])
def test_as_a_signal_it_does_not_depend_on_the_blocks(length: int) -> None:
    run = circling(0.3, 200.0)
    columns = np.array([run["angle"], run["x"], run["y"]])
    turns = TurnVector()
    parts = [turns.of(*columns[:, k : k + length]) for k in range(0, len(run), length)]
    np.testing.assert_array_equal(np.concatenate(parts), once_per_turn(run))


def test_as_a_signal_it_is_known_from_the_first_whole_turn_on() -> None:
    """Of a motion at the spindle's rate alone; the second turn is not seen through a gap."""
    psi = 200.0 * np.arange(0.0, 0.2, 1e-3)
    x, y = E * np.cos(psi + 0.3), E * np.sin(psi + 0.3)
    found = TurnVector().of(psi, x, y)
    known = psi >= 2 * math.pi
    assert np.isnan(found[~known]).all()
    np.testing.assert_allclose(found[known], E * np.exp(0.3j), rtol=1e-9)
    jumped = psi + 2.0 * (np.arange(200) >= 100)
    again = np.isnan(TurnVector().of(jumped, x, y))
    assert again[100] and not again[99] and not again[100 + 33]
    lost = np.isnan(TurnVector().of(psi, np.where(np.arange(200) == 100, np.inf, x), y))
    assert lost[100] and not lost[99] and not lost[100 + 33]
    still = TurnVector().of(np.concatenate([psi, psi[-1:]]), np.append(x, 0), np.append(y, 0))
    assert np.isnan(still[-1])


def test_a_drive_turns_its_phase_at_the_critical_speed() -> None:
    """Without balls: near 0 below it, late by near half a turn above it, as the closed form."""
    for speed in (50.0, 200.0):
        changes = ["profile=", f"start.speed={speed}", "duration=20"]
        run = run_scene(load_scene("no-ball", changes), [19.5])
        suspension, M = run.scene.effects["suspension"], run.scene.total_mass
        stiffness = suspension.stiffness - M * speed**2 + 1j * suspension.damping * speed
        expected = M * run.scene.rotor.eccentricity * speed**2 / stiffness
        assert run.metrics["phase"] == pytest.approx(np.angle(expected), abs=2e-3)
        assert run.metrics.once_per_turn == pytest.approx(abs(expected), rel=2e-3)
        (sample,) = run.report()["samples"]
        assert sample["phase"] == pytest.approx(np.angle(expected), abs=1e-2)
        assert sample["once_per_turn"] == pytest.approx(abs(expected), rel=1e-2)


def test_a_slow_or_standing_spindle_does_not_fill_the_memory() -> None:
    """One turn of 500,000 samples, whose answer is known; then an hour at standstill."""
    psi = np.linspace(0.0, 2.1 * math.pi, 500_000)
    x, y = E * np.cos(psi + 0.3), E * np.sin(psi + 0.3)
    turns = TurnVector()
    parts = [turns.of(psi[k : k + 1000], x[k : k + 1000], y[k : k + 1000])
             for k in range(0, len(psi), 1000)]  # fmt: skip
    together = np.concatenate(parts)
    np.testing.assert_array_equal(together, TurnVector().of(psi, x, y))
    np.testing.assert_allclose(together[-1000:], E * np.exp(0.3j), rtol=1e-5)
    for _ in range(360):
        held = np.full(10_000, psi[-1])
        assert np.isnan(turns.of(held, 0 * held, 0 * held)).all()
    assert len(pickle.dumps(turns)) < 100_000

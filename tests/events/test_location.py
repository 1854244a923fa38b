"""Events are found in their order and at their time, however many there are in a step."""

import math
from typing import Any

import numpy as np
import pytest

from ab_sim.engine.events.balls import put_branches
from ab_sim.engine.events.cubics import crossing, landing, minimum_of_cubic
from ab_sim.engine.events.event_functions import NEVER
from ab_sim.engine.events.location import (
    MAX_EVENTS,
    check_branches,
    step_over_events,
)
from ab_sim.engine.events.run import Run, evaluate
from ab_sim.model.dynamics.system import DIRECTION, JOINED, LOADED
from tests.events.track import passing_points, run_on_track


def go(run: Run, begin: float, length: float) -> bool:
    """One step that begins anew; its result is the state."""
    put_branches(run.balls)
    evaluate(run, begin, run.state, run.work.slope)
    check_branches(run, begin)
    known = step_over_events(run, begin, length, begin + length)
    run.state[:] = run.work.trial
    return known


def test_equal_balls_bounce_as_points_pass() -> None:
    """Thirty impacts in a few steps, none forgotten and none out of turn."""
    rng = np.random.default_rng(4)
    n, spacing, met = 6, 0.3, 0
    for _ in range(5):
        gaps = rng.uniform(0.1, 1.0, n)
        gaps *= (2.0 * math.pi - n * spacing) / gaps.sum()
        places = np.cumsum(gaps + spacing) - gaps[0] - spacing
        speeds = rng.normal(0.0, 2.0, n)
        run = run_on_track(places, speeds, spacing=spacing)
        for k in range(4):
            go(run, 0.25 * k, 0.25)
        points, want, length = passing_points(places, speeds, spacing, 1.0)
        got = run.state[:n] - spacing * np.arange(n)
        order = np.argsort(got % length)
        np.testing.assert_allclose((got % length)[order], points, atol=1e-11)
        np.testing.assert_allclose(run.state[n:][order], want, atol=1e-11)
        assert run.work.counts[1] == 0
        met += run.work.counts[0]
    assert met > 30


def test_of_two_events_the_first_comes_first() -> None:
    """The second would not happen without it: the struck ball is at rest."""
    run = run_on_track([0.0, 1.0, 1.5], [4.0, 0.0, 0.0], spacing=0.2, restitution=0.5)
    go(run, 0.0, 0.5)
    # 0.8 at 4, then 1 goes on at 3 and 0 at 1; after 0.3 more it strikes 2.
    t1, t2 = 0.2, 0.2 + 0.1
    speeds = [1.0, 0.75, 2.25]
    places = [0.8 + 0.3, 1.3 + 0.75 * (0.5 - t2), 1.5 + 2.25 * (0.5 - t2)]
    assert run.work.counts.tolist() == [2, 0] and t1 < t2
    np.testing.assert_allclose(run.state, [*places, *speeds], atol=1e-11)


@pytest.mark.parametrize("deep", [1e-6, -1e-6])
def test_a_gap_that_closes_within_a_step_and_opens_again(deep: float) -> None:
    """Ball 0 brakes: it comes as near as ``deep`` beyond touching, or stays away by that."""

    def force(time: float, state: np.ndarray) -> np.ndarray:
        return np.array([-8.0, 0.0])

    # The gap 1 - v t + 4 t^2 is lowest by v^2 / 16.
    speed = 4.0 * math.sqrt(1.0 + deep)
    run = run_on_track([0.0, 1.2], [speed, 0.0], spacing=0.2, force=force)
    go(run, 0.0, 1.0)
    assert run.work.counts.tolist() == [int(deep > 0.0), 0]
    assert (run.state[3] != 0.0) == (deep > 0.0)


def test_a_ball_that_slides_to_rest_sticks_there() -> None:
    run = run_on_track([0.3], [-2.0], friction=0.5, load=lambda t, y: 10.0)
    run.balls.discrete[0, DIRECTION] = -1
    go(run, 0.0, 1.0)
    assert run.work.counts.tolist() == [1, 0]
    assert run.state[1] == 0.0 and run.balls.discrete[0, DIRECTION] == 0
    assert run.state[0] == pytest.approx(0.3 - 2.0**2 / (2.0 * 5.0), abs=1e-12)


def test_a_ball_lets_go_when_its_push_exceeds_friction() -> None:
    """Pushed by 10 t against a friction of 5 at most: its speed is the integral from 0.5 s on."""
    run = run_on_track(
        [0.0], [0.0], friction=0.5, load=lambda t, y: 10.0, force=lambda t, y: 10 * t
    )
    go(run, 0.0, 1.0)
    assert run.work.counts.tolist() == [1, 0] and run.balls.discrete[0, DIRECTION] == 1
    np.testing.assert_allclose(run.state, [10 / 6 * 0.125, 5.0 * 0.25], atol=1e-10)


def test_friction_that_gives_way_within_a_step() -> None:
    """A push that exceeds it in the midst of a step only: the ball slides a bit, and sticks."""

    def force(time: float, state: np.ndarray) -> float:
        return 5.05 - 2.4 * (time - 0.5) ** 2

    run = run_on_track([0.0], [0.0], friction=0.5, load=lambda t, y: 10.0, force=force)
    go(run, 0.0, 1.0)
    assert run.work.counts.tolist() == [2, 0] and run.balls.discrete[0, DIRECTION] == 0
    # From -a on its speed is 0.8 (t + a)^2 (2 a - t).
    a = math.sqrt(0.05 / 2.4)
    np.testing.assert_allclose(run.state, [0.8 * (3.0 * a) ** 4 / 12.0, 0.0], atol=1e-10)


def test_friction_that_gives_way_before_another_ball_slips() -> None:
    """The first ball slides and sticks again before the second, further on, starts to slide."""

    def force(time: float, state: np.ndarray) -> np.ndarray:
        return np.array([5.05 - 2.4 * (time - 0.5) ** 2, 10.0 * (time - 0.3)])[: len(state) // 2]

    alone, beside = (
        run_on_track(places, [0.0] * len(places), friction=0.5, load=lambda t, y: 10.0, force=force)
        for places in ([0.0], [0.0, 2.0])
    )
    for run in alone, beside:
        go(run, 0.0, 1.0)
    assert alone.work.counts.tolist() == [2, 0] and beside.work.counts.tolist() == [3, 0]
    np.testing.assert_allclose(beside.state[[0, 2]], alone.state, atol=1e-10)


def test_a_ball_that_nothing_presses_on_the_race_is_not_braked() -> None:
    def load(time: float, state: np.ndarray) -> float:
        return 4.0 - 10.0 * time

    run = run_on_track([0.0], [1.0], friction=0.1, load=load)
    run.balls.discrete[0, DIRECTION] = 1
    go(run, 0.0, 1.0)
    assert run.work.counts.tolist() == [1, 0] and run.balls.discrete[0, LOADED] == 0
    assert run.state[1] == pytest.approx(1.0 - 0.1 * 4.0 * 0.4 / 2.0, abs=1e-11)


def test_balls_that_meet_too_often_for_a_step_stay_together() -> None:
    """Squeezed between two that close in: infinitely many impacts in a finite time."""

    def force(time: float, state: np.ndarray) -> np.ndarray:
        return np.array([50.0, 0.0, -50.0])

    run = run_on_track([0.0, 0.5, 1.0], [0.0, 0.3, 0.0], spacing=0.2, force=force, restitution=0.7)
    go(run, 0.0, 2.0)
    assert run.work.counts[0] > MAX_EVENTS + 20 * 3 and run.work.counts[1] == 1, "it says so"
    assert run.balls.discrete[:2, JOINED].tolist() == [1, 1]
    assert np.ptp(run.state[3:]) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(np.diff(run.state[:3]), 0.2, atol=1e-12)


def test_the_minimum_of_a_cubic_is_its_lowest_value_within() -> None:
    rng, found = np.random.default_rng(6), 0
    for _ in range(300):
        g0, g1, r0, r1 = rng.normal(size=4)
        where, lowest = minimum_of_cubic(g0, g1, r0, r1)
        x = np.linspace(0.0, 1.0, 20001)
        p, q = 3 * (g1 - g0) - 2 * r0 - r1, 2 * (g0 - g1) + r0 + r1
        values = g0 + x * (r0 + x * (p + x * q))
        if where == 0.0:
            assert r0 >= 0.0 or r1 <= 0.0 or values.min() >= min(g0, g1) - 1e-9
        else:
            found += 1
            assert lowest == pytest.approx(values.min(), abs=1e-7)
    assert found > 50


def test_where_a_cubic_is_zero() -> None:
    """One that rises and falls again, one that falls all along, and a straight line."""
    for root in (0.2, 0.5, 0.93):
        low, high = 2.0, 5.0

        def rising(x: float, root: float = root) -> float:
            return (1.0 + 0.3 * x) * (root - x) * (x + 0.05)

        def slope(x: float, function: Any) -> float:
            return float((function(x + 1e-6) - function(x - 1e-6)) / 2e-6 / 3.0)

        ends = rising(0.0), rising(1.0)
        rates = slope(0.0, rising), slope(1.0, rising)
        found = crossing(low, high, *ends, *rates)
        assert found == pytest.approx(low + 3.0 * root, abs=1e-7)
        line = crossing(low, high, root, root - 1.0, NEVER, -1.0 / 3.0)
        assert line == pytest.approx(low + 3.0 * root)
        # x = root is where the inverse cubic is that the ends and rates say.
        inverse = crossing(low, high, 1.0 * root, root - 1.0, -1.0 / 3.0, -1.0 / 3.0)
        assert inverse == pytest.approx(low + 3.0 * root)
        # Zero at the start, up, and down again at the root.
        back = landing(root * 0.7, 0.7 * (root - 1.0), 0.7 * (root - 2.0))
        assert back == pytest.approx(root)
    assert landing(1.0, 1.0, 1.0) == landing(-1.0, -1.0, -1.0) == 1.0, "it does not come down"


def test_an_event_takes_three_trial_steps() -> None:
    """Of a ball that comes to rest; where several do, it takes some more."""
    steps = 0
    run = run_on_track([0.0, 2.0], [1.0, 3.0], friction=0.7, load=lambda t, y: 9.0 + np.sin(y[0]))
    run.balls.discrete[:2, DIRECTION] = 1
    inner = run.scene.step

    def counted(*arguments: Any) -> None:
        nonlocal steps
        steps += 1
        inner(*arguments)  # type: ignore[operator]

    run = run._replace(scene=run.scene._replace(step=counted))
    for k in range(10):
        go(run, 0.1 * k, 0.1)
    assert run.work.counts[0] == 2 and np.all(run.state[2:] == 0.0)
    assert steps <= 10 + 2 * 4, "two to find it, one for the rest of the step, and one to spare"

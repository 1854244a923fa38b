"""The error estimate beside a running drive: near the truth, harmless, and within its share."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import DivergedError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy import live_checks
from ab_sim.drive.accuracy.live_checks import SLICE, WINDOW, LiveChecks
from ab_sim.drive.accuracy.trials import Deviation, Samples, deviation
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import load_scene

PER_WAKE = 4


def run(checks: LiveChecks, seconds: float, each: float = 1.0) -> Trajectory:
    """As a node does it, whose work takes ``each`` second at each wake-up."""
    parts: list[Trajectory] = []
    wakes = 1
    while len(parts) < wakes:
        parts.append(checks.advance(PER_WAKE))
        checks.work(each)
        wakes = round(seconds / np.diff(parts[0]["time"])[0] / PER_WAKE)
    return Trajectory.join(parts)


def true_error(name: str, changes: list[str], got: Trajectory, step: float) -> Deviation:
    fine = Drive(load_scene(name, [*changes, "solver.stepper=rk8", f"solver.step={step / 4:.9g}"]))
    want = fine.advance(4 * len(got))
    return deviation(Samples.of(got), Samples.of(want), fine.scene.whirl_unit[0])


@pytest.mark.parametrize(
    ("name", "stepper", "step"),
    [
        ("thesis-hold", "rk4", 1e-3),
        ("thesis-hold", "rk4", 5e-4),
        ("thesis-hold", "tsit5", 1e-3),
        ("thesis-hold", "rk8", 4e-3),
        ("thesis-hold", "rk8", 2e-3),
        ("weak-motor", "rk4", 1e-3),
        ("weak-motor", "rk8", 4e-3),
        ("nsc-case-1", "rk4", 1e-3),
        ("nsc-case-1", "rk8", 2e-3),
        ("nsc-case-2", "rk4", 1e-3),
        ("nsc-case-1", "imex8", 2e-3),
    ],
)
def test_estimate_is_near_the_true_error(name: str, stepper: str, step: float) -> None:
    """Within a factor of two of the largest error of the whole run; it does not exaggerate."""
    changes = ["effects.rolling_friction=", "balls.radius=1e-3"] if name == "thesis-hold" else []
    solver = [f"solver.stepper={stepper}", f"solver.step={step}"]
    checks = LiveChecks(Drive(load_scene(name, [*changes, *solver])), 0.5)
    got = run(checks, 6.0)
    true, found = true_error(name, changes, got, step), checks.largest
    assert checks.checked > 0.9 * len(got) - SLICE
    assert 0.5 * true.angle <= found.angle <= 1.3 * true.angle
    assert 0.5 * true.whirl <= found.whirl <= 1.3 * true.whirl


def commands(k: int) -> list[float]:
    """What is commanded at a wake-up: now and then something, also twice at once."""
    if k % 37 == 5:
        return [3.0 * (k % 50)]
    return [200.0, 1.0 * (k % 90)] if k % 101 == 7 else []


@pytest.mark.parametrize("changes", [[], ["sensors.accelerometer={}"]])
def test_the_run_is_the_same_with_and_without(changes: list[str]) -> None:
    scene = load_scene("one-ball", changes)
    plain, checked = Drive(scene, commanded=True), Drive(scene, commanded=True)
    checks = LiveChecks(checked, 0.5)
    for k in range(700):
        for speed in commands(k):
            plain.command(speed)
            checks.command(speed)
        one, other = plain.advance(1 + k % 7), checks.advance(1 + k % 7)
        assert one.samples.tobytes() == other.samples.tobytes()
        checks.work(1.0)
    assert checks.checked > WINDOW and plain.events == checked.events
    assert plain.present().samples.tobytes() == checked.present().samples.tobytes()


def test_commands_are_followed_at_the_same_instants() -> None:
    """Else the two would differ by what the command does, not by the step."""
    scene = load_scene("one-ball", ["effects.rolling_friction="])
    checks = LiveChecks(Drive(scene, commanded=True), 0.5)
    for k in range(1500):
        for speed in commands(k):
            checks.command(speed)
        checks.advance(1 + k % 7)
        checks.work(1.0)
    assert checks.checked > 3 * WINDOW
    assert checks.largest.angle < 1e-11 and checks.largest.whirl < 1e-9


def test_slices_do_not_matter() -> None:
    """Cut between samples, or within what one wake-up did."""
    found = []
    for steps in (1, 7, 10**6):
        checks = LiveChecks(Drive(load_scene("nsc-case-1", ["solver.stepper=rk4"])), 1.0)
        for _ in range(25):
            checks.advance(5)
            checks.check(steps)
        checks.check(10**6)
        assert checks.checked == 125
        found.append(checks.largest)
    assert found[0] == found[1] == found[2]


class Clock:
    """CPU time, as the test wants it: a step of half the length takes a while, all else nothing."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, per_step: float) -> None:
        self.now, advance = 0.0, Drive.advance

        def timed(drive: Drive, steps: int = 1) -> Trajectory:
            if drive.step < 0.9e-3:
                self.now += per_step * steps
            return advance(drive, steps)

        monkeypatch.setattr(Drive, "advance", timed)
        monkeypatch.setattr(live_checks, "time", SimpleNamespace(thread_time=lambda: self.now))


@pytest.mark.parametrize("share", [0.01, 0.05, 0.5])
@pytest.mark.parametrize("per_step", [1e-6, 2e-5, 1e-3])
def test_checks_keep_within_their_share(
    share: float, per_step: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the first slice on, that is; what costs too much is done more rarely."""
    clock = Clock(monkeypatch, per_step)
    checks = LiveChecks(Drive(load_scene("one-ball")), share, longest=1e-3)
    checks.warm_up(100.0, PER_WAKE)
    assert checks.checked == 0 and checks.share == 0.0 and checks.largest == (0.0, 0.0)
    for _ in range(2500):
        checks.advance(PER_WAKE)
        before = clock.now
        checks.work(1e-3)
        assert checks.share <= share * (1 + 1e-9)
        assert clock.now - before <= max(1e-3, per_step) * (1 + 1e-9)
    spend = min(share / (1 - share) * 2.5, 2500 * 8 * per_step)
    assert checks.checked > 0.45 * min(spend / per_step, 2500 * 8) / 2, "and they use it"


def diverging_half_steps(advance: Callable[..., Trajectory]) -> Callable[..., Trajectory]:
    def advanced(drive: Drive, steps: int = 1) -> Trajectory:
        if drive.step < 0.9e-3:
            raise DivergedError("as a test wants it")
        return advance(drive, steps)

    return advanced


def test_a_diverging_half_step_is_an_infinite_error(monkeypatch: pytest.MonkeyPatch) -> None:
    checks = LiveChecks(Drive(load_scene("one-ball")), 0.5)
    run(checks, 0.5)
    with monkeypatch.context() as half_steps:
        half_steps.setattr(Drive, "advance", diverging_half_steps(Drive.advance))
        run(checks, 0.5)
    assert np.isinf(checks.largest).all() and np.isinf(checks.estimate).all()
    run(checks, 2.5)
    assert np.isfinite(checks.estimate).all() and np.isinf(checks.largest).all()


def test_a_ledger_is_refused(scene: Any) -> None:
    with pytest.raises(ValueError, match="energy balance"):
        LiveChecks(Drive(scene(), energy_balance=True), 0.05)


def test_reset_begins_again() -> None:
    drive = Drive(load_scene("nsc-case-1", ["solver.stepper=rk4"]))
    checks = LiveChecks(drive, 0.5)
    first = run(checks, 1.0)
    found = checks.largest
    assert found.angle > 0
    checks.reset()
    assert drive.steps == 0 and checks.largest == checks.estimate == (0.0, 0.0)
    assert run(checks, 1.0).samples.tobytes() == first.samples.tobytes()
    assert checks.largest == found


def test_the_estimate_forgets_windows_that_are_long_past() -> None:
    drive = Drive(load_scene("nsc-case-1", ["solver.stepper=rk4"]))  # settles from its start
    checks = LiveChecks(drive, 0.5)
    run(checks, 4.0)
    assert checks.estimate.angle < 0.01 * checks.largest.angle


@pytest.mark.parametrize("share", [0.0, -0.1, 1.1, float("nan")])
def test_a_share_is_a_share(share: Any) -> None:
    with pytest.raises(ValueError, match=f"^share = {share}: "):
        LiveChecks(Drive(load_scene("one-ball")), share)

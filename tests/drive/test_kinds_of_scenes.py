"""Code of many kinds of scenes in one process: the last ones are remembered, what runs is kept."""

import gc
import weakref
from collections import OrderedDict

import pytest

from ab_sim.drive import Drive
from ab_sim.kernels import code
from ab_sim.scene import load_scene


def drive_of(balls: int, stepper: str) -> Drive:
    angles = f"start.ball_angles={[0.3 * k for k in range(balls)]}"
    frictionless = "effects.rolling_friction="
    changes = [f"balls.count={balls}", angles, frictionless, f"solver.stepper={stepper}"]
    return Drive(load_scene("thesis-hold", changes))


@pytest.mark.parametrize("stepper", ["rk8", "generalized-alpha", "collocation", "taylor"])
def test_a_drive_goes_on_when_its_kind_is_forgotten(
    monkeypatch: pytest.MonkeyPatch, stepper: str
) -> None:
    monkeypatch.setattr(code, "_codes", OrderedDict())
    monkeypatch.setattr(code, "KINDS", 2)
    one, other = drive_of(2, stepper), drive_of(2, stepper)
    whole = other.advance(40).samples.tobytes()
    first = one.advance(20).samples.tobytes()
    for balls in (1, 3, 4):
        drive_of(balls, stepper).advance(1)
        gc.collect()
    assert len(code._codes) == 2
    assert first + one.advance(20).samples.tobytes() == whole


@pytest.mark.parametrize("stepper", ["collocation", "taylor"])
def test_a_forgotten_kind_that_nothing_runs_is_freed(
    monkeypatch: pytest.MonkeyPatch, stepper: str
) -> None:
    monkeypatch.setattr(code, "_codes", OrderedDict())
    monkeypatch.setattr(code, "KINDS", 1)
    drive = drive_of(2, stepper)
    (kept,) = map(weakref.ref, code._codes.values())
    del drive
    drive_of(3, stepper)
    gc.collect()
    assert kept() is None

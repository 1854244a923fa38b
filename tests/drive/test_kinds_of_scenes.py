"""Code of many kinds of scenes in one process: the last ones are remembered, what runs is kept."""

import gc
import json
import resource
import subprocess
import sys
import weakref
from collections.abc import Sequence
from pathlib import Path

import pytest

from ab_sim.drive import Drive
from ab_sim.engine.kernels import code
from ab_sim.engine.kernels.code import code_of
from ab_sim.model.spindle.schedule import Ramp
from ab_sim.scene import load_scene


def drive_of(balls: int, stepper: str, *further: str) -> Drive:
    angles = f"start.ball_angles={[0.3 * k for k in range(balls)]}"
    frictionless = "effects.rolling_friction="
    changes = [f"balls.count={balls}", angles, frictionless, f"solver.stepper={stepper}"]
    return Drive(load_scene("thesis-hold", [*changes, *further]))


@pytest.mark.parametrize("stepper", ["rk8", "generalized-alpha", "imex8", "taylor"])
def test_a_drive_goes_on_when_its_kind_is_forgotten(
    monkeypatch: pytest.MonkeyPatch, stepper: str
) -> None:
    monkeypatch.setattr(code, "KINDS", 2)
    one, other = drive_of(2, stepper), drive_of(2, stepper)
    first_code = code_of(one.system, Ramp)
    whole = other.advance(40).samples.tobytes()
    first = one.advance(20).samples.tobytes()
    for balls in (1, 3):
        drive_of(balls, stepper).advance(1)
        gc.collect()
    assert code_of(one.system, Ramp) is not first_code
    assert first + one.advance(20).samples.tobytes() == whole


@pytest.mark.parametrize("stepper", ["imex8", "taylor"])
def test_a_forgotten_kind_that_nothing_runs_is_freed(
    monkeypatch: pytest.MonkeyPatch, stepper: str
) -> None:
    monkeypatch.setattr(code, "KINDS", 1)
    drive = drive_of(2, stepper)
    drive.advance(1)
    kept = weakref.ref(code_of(drive.system, Ramp))
    del drive
    drive_of(3, stepper).advance(1)
    gc.collect()
    assert kept() is None


EFFECTS = ([], [TILT := "effects.gravity.tilt=0.3"], [TILT, "effects.spindle_acceleration="])
KINDS = [(balls, effects) for balls in range(1, 5) for effects in EFFECTS]
AGAIN = 20


def memory() -> list[float]:
    """Return this process' memory [MB]: of one kind, after ``AGAIN``, and of ``KINDS``."""
    # Where it hangs is found by SciPy, which is imported then.
    code.KINDS, two = 1, [(9, EFFECTS[1]), (8, EFFECTS[1])]
    first, again = memory_after(two), memory_after(AGAIN // 2 * two)
    code.KINDS = 1 + len(KINDS)
    return [first, again, memory_after(KINDS)]


def memory_after(kinds: Sequence[tuple[int, list[str]]]) -> float:
    for balls, effects in kinds:
        drive_of(balls, "rk8", *effects).advance(1)
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    return pages * resource.getpagesize() / 1e6


def test_a_kind_keeps_little_memory_and_leaves_none() -> None:
    run = "import json; from tests.drive.test_kinds_of_scenes import memory; "
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", f"{run}print(json.dumps(memory()))"],
        capture_output=True,
        text=True,
        check=True,
    )
    first, again, kept = json.loads(done.stdout.splitlines()[-1])
    # Measured: 0.0. Passes that nobody disposes of would leave 0.4.
    assert (again - first) / AGAIN < 0.2
    # Measured: 0.4. If functions kept their modules and target machines, it would be 3.
    assert (kept - again) / len(KINDS) < 1.5

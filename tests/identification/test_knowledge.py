"""What recordings cannot tell is named, all of it and nothing else."""

import math
from pathlib import Path

import numpy as np
import pytest

import ab_sim
from ab_sim.base.errors import InputError
from ab_sim.identification.intervals import OPEN as NOT_KNOWN
from ab_sim.identification.result import FITS, OPEN
from tests.identification import drives
from tests.identification.knowledge_cases import (
    ARM,
    BALL,
    BALLS,
    CASES,
    DECK,
    DRAG,
    Case,
    opened_in,
    problem_of,
)

GUESS = dict(zip((*DECK, *BALLS), (1100.0, 1.7, 8.5e-5, 6e-4, 0.25), strict=True))


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_what_theory_leaves_open_is_named(case: Case) -> None:
    """More drives of each case: benchmarks/identification_knowledge.py."""
    springs = {key for key, value in case.changes.items() if value is None}
    guess = {key: value for key, value in GUESS.items() if not key.startswith((*springs, "-"))}
    opened = opened_in(*problem_of(case, drives.scene(), drives.scene(guess), 0), 0)
    named = {name for each in opened for name, _ in each.parts}
    assert named == {name for direction in case.unknown for name in direction}
    assert len(opened) == len(case.unknown)


def test_a_motor_s_numbers_are_refused_as_no_torque_was_measured(tmp_path: Path) -> None:
    key = "effects.motor.rotor_inertia"
    motor = {
        "effects.motor": {
            "rotor_inertia": 1e-5, "torque_limit": 0.1, "proportional_gain": 1e-3,
            "integral_gain": 0.0, "back_emf_slope": 0.0,
        }
    }  # fmt: skip
    file = drives.bench(tmp_path, drives.scene(), "with")
    with pytest.raises(InputError, match="no torque was measured"):
        ab_sim.identify(file, drives.scene(motor), [key], maps=[drives.mapping(tmp_path)])


def test_balls_that_never_moved_tell_neither_drag_nor_friction(tmp_path: Path) -> None:
    """They slip by 4 mrad before the race presses on them: any drag, and any arm, fits."""

    def scene(arm: float, **more: float) -> ab_sim.Scene:
        stuck = {"effects.rolling_friction": {"arm": arm}, "balls.radius": 1e-3, "duration": 1.5}
        return drives.scene({**stuck, **more})

    drive = scene(0.05)
    moved = np.ptp(ab_sim.simulate(drive).trajectory.ball_angles, axis=0)
    assert np.max(np.abs(moved)) < 0.005
    found = ab_sim.identify(
        drives.bench(tmp_path, drive, "with"), scene(0.03, **GUESS), [*DECK, BALL, DRAG, ARM],
        without_balls=[drives.bench(tmp_path, drive, "bare", balls=False, seed=1)],
        maps=[drives.mapping(tmp_path)], propose=False,
    )  # fmt: skip
    assert found.verdict == OPEN and found.verdict != FITS
    for name in (DRAG, ARM):
        each = found[name]
        assert (each.low, each.high, each.how) == (-math.inf, math.inf, NOT_KNOWN), name
        assert any(name in reason for reason in found.reasons)
    assert "make a recording in which the balls move" in " ".join(found.reasons)
    for name in (*DECK, BALL):
        assert np.isfinite(found[name].high), name

"""Batches of decks, and live checks of a deck: what is built on drives."""

from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.drive.accuracy.live_checks import LiveChecks
from ab_sim.scene import load_scene
from tests.batch.test_batch import assert_equal_to_drives
from tests.deck.scenes import ODD, odd
from tests.deck.test_against_reference import RAMP, SMOOTH

MOUNTS = ODD["mounts"]


def test_decks_side_by_side() -> None:
    """All numbers of a deck may differ but those of its mounts, which are the same in all lanes."""
    base = odd("smooth", {"effects": SMOOTH, "duration": 0.1}, RAMP)
    variations: list[dict[str, Any]] = [
        {
            "deck.center": [6e-3, -0.025 + 1e-3 * i, -4e-3],
            "deck.inertia": [1.3e-4, 1.7e-4 + 1e-6 * i, 2.6e-4, -1.2e-5, 6e-6, -9e-6],
            "rotor.height": 7e-3 - 1e-3 * i,
            "rotor.inertia": [5.6e-6, 5.7e-6, 1.1e-5, 2e-7, 1e-7 * i, -6e-8],
            "rotor.mass": 0.145 + 0.002 * i,
            "race.height": [5e-3 + 1e-4 * i, -3e-3],
            "balls.race": [i % 2, 1],
            "balls.mass": [2e-4, 3e-4 + 1e-5 * i],
            "effects.gravity.tilt": 0.3 * i,
            "effects.hardening_suspension.cubic_stiffness": 1e8 * i,
            "start.deck.tilt": [0.02, -0.03 + 0.01 * i, 0.01],
            "start.ball_rates": [4.0 - i, -3.0],
            "profile.acceleration": 400.0 + 3.1 * i,
        }
        for i in range(5)
    ]
    stiff = [{**mount, "stiffness": 1100.0} for mount in MOUNTS]
    variations += [
        {"mounts": stiff},
        {"mounts": stiff, "balls.mass": 1e-4},
        {"mounts": MOUNTS[:3]},
        {"mounts": []},
    ]
    assert_equal_to_drives(base, variations)


def test_live_checks_see_an_error_along_the_shaft() -> None:
    """A deck that moves along the shaft only has no other."""
    changes = ["start.deck.position=[0,0,0.001]", "start.speed=0", "rotor.eccentricity=0"]
    changes += ["balls.count=2", "deck.center=[0,0,0]", "mounts=" + str(_centred())]
    drive = Drive(load_scene("feeding-deck", [*changes, "solver.step=0.004"]))
    checks = LiveChecks(drive, 1.0)
    taken = [checks.advance(5) for _ in range(25)]
    checks.check(10**6)
    assert checks.checked == 125
    (unit, symbol) = drive.scene.whirl_unit
    position = np.concatenate([part.position for part in taken])
    assert np.abs(position[:, :2]).max() < 1e-9 and np.ptp(position[:, 2]) > 1e-3
    fine = Drive(load_scene("feeding-deck", [*changes, "solver.step=0.001"])).advance(500)
    true = np.abs(fine.decimated(4).position - position).max() / unit
    assert symbol == "R" and true > 1e-12
    assert checks.largest.whirl == pytest.approx(true, rel=0.1)


def _centred() -> list[dict[str, Any]]:
    """The feeding deck's mounts, but symmetric about the shaft."""
    corners = [(i * 0.06, j * 0.06, 0.0) for i in (-1, 1) for j in (-1, 1)]
    return [{"position": [*at], "stiffness": 1063.1, "damping": 0.6} for at in corners]

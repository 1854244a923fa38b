"""Steps that are too long for a deck in space are known beforehand."""

from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import DivergedError, SceneError
from ab_sim.drive import Drive
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import linear_rates, linearised, system_of
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene
from tests.deck.scenes import ODD, Changes, odd
from tests.deck.test_against_reference import GRAVITY

STILL: Changes = {
    "rotor": {"eccentricity": 0.0},
    "start": {"speed": 0.0, "ball_angles": [1.0, 1.0], "deck": None},
    "balls": {"race": 0},
}


def longest(scene: Scene) -> float:
    """The longest stable step [s]."""
    return choose_stepper(scene, system_of(scene)).longest


@pytest.mark.parametrize("mass", [2e-4, 0.02, 0.2])
def test_drag_of_balls_of_any_mass(mass: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also of balls that are heavier than the deck: they shake it, and are the lighter for it."""
    drag = {"viscous_drag": {"coefficient": 2e4 * mass}}
    heavy: Changes = {"rotor": {"mass": 0.04}, "balls": {"mass": mass}, "effects": drag}
    scene = odd("plain", STILL, heavy, {"solver": {"step": 1e-6}})
    limit = longest(scene)
    assert "drag" in choose_stepper(scene, system_of(scene)).limited_by
    rates = []
    monkeypatch.setattr("ab_sim.engine.integrate.choose.check_step", lambda *_: None)
    for share in (0.9, 1.15):
        beside = changed_scene(scene, {"solver.step": round(share * limit, 9)}, "test")
        drive = Drive(beside, energy_balance=True)
        try:
            rates.append(np.abs(drive.advance(400).ball_rates[-1]).max())
        except DivergedError:
            rates.append(np.inf)
    assert rates[0] < 4.0 < 100.0 < rates[1]


def test_mounts_that_harden() -> None:
    """As stiff as where the deck hangs, which is all their stiffness here."""
    soft = [{**mount, "stiffness": 0.0} for mount in ODD["mounts"]]
    springs: dict[str, Any] = {**GRAVITY, "hardening_suspension": {"cubic_stiffness": 1e9}}
    system = system_of(odd("smooth", STILL, {"mounts": soft, "effects": springs}))
    (fastest,) = [r for what, r in linear_rates(system, 0.0).items() if "mounts" in what]
    at_rest = np.abs(np.linalg.eigvals(linearised(system).matrix(0.0))).max()
    # Chords are up to three times as soft as tangents.
    assert at_rest / np.sqrt(3.0) < abs(fastest) < at_rest
    free = system_of(odd("smooth", STILL, {"mounts": [], "effects": springs}))
    assert not [what for what in linear_rates(free, 0.0) if "mounts" in what]


STIFF = [{**mount, "stiffness": 1e7} for mount in ODD["mounts"]]


def test_auto_takes_what_stiff_mounts_leave_stable() -> None:
    """Steps in parts follow the deck on them, as a hundred times as many steps do."""
    solvers = {"stepper": "auto", "step": 1e-3}, {"stepper": "rk8", "step": 1e-5}
    auto, fine = (
        Drive(odd("plain", {"mounts": STIFF, "solver": solver}), energy_balance=True)
        for solver in solvers
    )
    assert auto.choice.stepper.name == "rk8" and auto.choice.stepper.parts > 1
    assert "for the deck's motion on its mounts, whose rate is" in auto.choice.reason
    run, same = auto.advance(100), fine.advance(10_000, every=100)
    off = np.abs(run.samples - same.samples)[:, 1:].max(axis=0)
    assert (off <= 1e-6 * np.abs(same.samples[:, 1:]).max(axis=0)).all()


def test_a_step_that_is_too_long_is_refused() -> None:
    """By what limits it, and to what; stiff mounts do it, and so does gyroscopic speed."""
    with pytest.raises(SceneError, match="deck's motion on its mounts") as told:
        Drive(odd("plain", {"mounts": STIFF, "solver": {"stepper": "rk8"}}), energy_balance=True)
    assert "; or leave solver.stepper to auto" in str(told.value)
    small: Changes = {"deck": {"inertia": [1e-6, 1e-6, 2e-6]}, "mounts": []}
    slow, fast = (odd("plain", small, {"start": {"speed": w}}) for w in (10.0, 900.0))
    assert longest(fast) < longest(slow)
    nothing = odd("plain", {"mounts": [], "effects": {"viscous_drag": None}}, STILL)
    assert longest(nothing) == np.inf

"""The kernel against an independent simulator: each effect, and several at once, with events."""

from typing import NamedTuple

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.scene.registry import effect_classes
from tests.conftest import THESIS
from tests.effects.parts import Changes, scene_of
from tests.overlap import assert_apart
from tests.reference import simulate
from tests.reference.of_scene import params_of

UNEQUAL = {"stiffness_2": 1400.0, "damping_2": 0.3, "axis_angle": 0.4}
GRAVITY = {"tilt": 1.2, "direction": 0.7}
OFFSET = {"offset_1": 3e-4, "offset_2": -2e-4}
OVAL = {**OFFSET, "lobe": 2e-4, "lobe_angle": 0.3}
VERY_OVAL = {**OVAL, "lobe": 1e-3}
WEAK = {"torque_limit": 8e-4}
LITTLE_DRAG = {"coefficient": 0.02}


class Case(NamedTuple):
    """A scene; which events the reference has to meet there, and how many in all."""

    company: str
    effects: Changes
    others: Changes = {}
    kinds: frozenset[str] = frozenset()
    events: int = 0
    time: float = 0.35


CASES = {
    "thesis": Case("thesis", {}),
    "gravity": Case("smooth", {"gravity": GRAVITY}),
    "unequal_suspension": Case("smooth", {"unequal_suspension": UNEQUAL}),
    "hardening and gravity": Case(
        "smooth", {"hardening_suspension": {"cubic_stiffness": 1e8}, "gravity": GRAVITY}
    ),
    "race_runout": Case("smooth", {"race_runout": OVAL}),
    "motor": Case("motor", {}),
    "motor at its limit": Case("motor", {"motor": WEAK}, {}, frozenset({"motor"}), 1),
    "rolling_friction": Case(
        "friction", {"rolling_friction": {"arm": 1e-6}}, {}, frozenset({"reverse"}), 1
    ),
    "rolling and dry friction": Case(
        "friction",
        {"rolling_friction": {"arm": 2e-5}, "race_friction": {"coefficient": 0.01}},
        {},
        frozenset({"release"}),
        2,
    ),
    "friction and gravity": Case(
        "friction",
        {"rolling_friction": {"arm": 2e-4}, "gravity": GRAVITY},
        {"start": {"speed": 40.0}},
        frozenset({"stick", "release"}),
        10,
    ),
    "ball_contact": Case(
        "contact",
        {"viscous_drag": LITTLE_DRAG},
        {"start": {"ball_angles": [0.6, -0.6]}},
        frozenset({"impact"}),
        1,
    ),
    "motor, runout, gravity": Case("all", {"race_runout": OVAL, "gravity": GRAVITY}),
    "all but contact": Case(
        "all",
        {
            "unequal_suspension": UNEQUAL,
            "gravity": GRAVITY,
            "hardening_suspension": {"cubic_stiffness": 1e8},
            "race_runout": OVAL,
            "race_friction": {"coefficient": 0.05},
        },
        {},
        frozenset({"release"}),
        2,
    ),
    "all on a round race": Case(
        "all",
        {
            "unequal_suspension": UNEQUAL,
            "gravity": GRAVITY,
            "race_runout": OFFSET,
            "race_friction": {"coefficient": 0.02},
            "viscous_drag": LITTLE_DRAG,
        },
        {"start": {"ball_angles": [0.6, -0.6]}},
        frozenset({"impact"}),
        2,
    ),
    "all on an oval race": Case(
        "all",
        {
            "unequal_suspension": UNEQUAL,
            "gravity": GRAVITY,
            "race_runout": VERY_OVAL,
            "race_friction": {"coefficient": 0.02},
            "viscous_drag": LITTLE_DRAG,
        },
        {"start": {"ball_angles": [0.6, -0.6]}},
        frozenset({"impact", "stick", "release"}),
        30,
    ),
    "a packed row on an oval race": Case(
        "all",
        {
            "gravity": GRAVITY,
            "race_runout": VERY_OVAL,
            "viscous_drag": LITTLE_DRAG,
            "ball_contact": {"restitution_coefficient": 0.0},
        },
        {
            "start": {"speed": 60.0, "ball_angles": None},
            "balls": {"count": 3, "mass": [1e-3, 6e-4, 1e-3]},
        },
        frozenset({"part", "impact"}),
        2,
    ),
}


@pytest.mark.parametrize("name", effect_classes())
def test_every_effect_is_in_a_case(name: str) -> None:
    known = {key for case in CASES.values() for key in case.effects} | set(THESIS["effects"])
    assert name in known, f"{name}: write it into tests/reference, too, and a case here"


@pytest.mark.parametrize("name", CASES)
def test_same_motion_as_the_reference(name: str) -> None:
    case = CASES[name]
    changes: Changes = {**case.others, "effects": case.effects, "solver": {"step": 5e-4}}
    scene = scene_of(case.company, changes)
    times = np.linspace(0, case.time, 11)[1:]
    # Events may come and go within the long steps that the reference could take.
    longest = 2e-3 if case.kinds else np.inf
    want = simulate(params_of(scene), start_angles(scene), times, rtol=1e-10, max_step=longest)
    kinds = {event.kind for event in want.events}
    assert case.kinds <= kinds and len(want.events) >= case.events, want.events
    drive = Drive(scene, energy_balance=True)
    got = drive.advance(round(case.time / drive.step))
    at = np.rint(times / drive.step).astype(int) - 1
    assert np.abs(want.theta - want.theta[0]).max() > 0.01 and np.abs(want.x).max() > 1e-5
    assert drive.steps_with_unresolved_events == 0
    assert_apart(drive, got)
    deck = got.position[at] - np.column_stack([want.x, want.y])
    assert np.abs(deck).max() < 2e-9 * 0.01
    assert np.abs(got.ball_angles[at] - want.theta).max() < 2e-9
    assert np.abs(got["speed"][at] - want.w).max() < 1e-8
    assert np.abs(drive.energy().dissipated - want.losses[-1].sum()) < 1e-8 * np.abs(
        drive.energy().stored
    )

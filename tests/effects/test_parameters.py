"""What effects take for their parameters, and scenes that they refuse."""

import math
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from ab_sim.base.errors import SceneError
from ab_sim.scene.registry import effect_classes
from tests.conftest import SceneMaker
from tests.deck.scenes import odd

TURN = 2 * math.pi
ANGLE = (-TURN, TURN, -6.5, 6.5)
UP_TO_ONE = (0.0, 1.0, -1e-9, 1.01)
NO_LIMIT = (0.0, 1e3, -1e-9)
"""Above, there is only one against slips of the keyboard."""
LIMITS: dict[str, dict[str, tuple[float, ...]]] = {
    "ball_contact": {
        "restitution_coefficient": UP_TO_ONE,
        "rest_speed": (1e-300, 1.0, 0.0, 1.01),
    },
    "ball_spin": {},
    "gravity": {"tilt": ANGLE, "direction": ANGLE, "acceleration": (0.0, 1e3, -1e-9, 1001.0)},
    "hardening_suspension": {"cubic_stiffness": NO_LIMIT},
    "motor": {
        "rotor_inertia": (0.0, 1e-300, -1e-9),
        "torque_limit": NO_LIMIT,
        "proportional_gain": (1e-300, 1e3, 0.0),
        "integral_gain": NO_LIMIT,
        "back_emf_slope": NO_LIMIT,
    },
    "race_friction": {"coefficient": (0.0, 10.0, -1e-9, 10.1)},
    "race_runout": {
        "offset_1": (-1.0, 1.0, -1.01, 1.01),
        "offset_2": (-1.0, 1.0, -1.01, 1.01),
        "lobe": UP_TO_ONE,
        "lobe_angle": ANGLE,
    },
    "rolling_friction": {"arm": UP_TO_ONE},
    "spindle_acceleration": {},
    "suspension": {"stiffness": NO_LIMIT, "damping": NO_LIMIT},
    "unequal_suspension": {
        **dict.fromkeys(("stiffness_1", "stiffness_2", "damping_1", "damping_2"), NO_LIMIT),
        "axis_angle": ANGLE,
    },
    "viscous_drag": {"coefficient": NO_LIMIT},
}
"""Of each parameter two that it may be, and what it may not."""


@pytest.mark.parametrize("name", effect_classes())
def test_parameters_keep_to_their_limits(name: str) -> None:
    """No stiffness, damping, inertia or friction is negative; an angle may be a whole turn."""
    assert name in LIMITS, f"{name}: needs a line in LIMITS in tests/effects/test_parameters.py"
    effect, limits = effect_classes()[name], LIMITS[name]
    assert tuple(limits) == effect._fields
    check, sound = TypeAdapter(effect).validate_python, {key: row[0] for key, row in limits.items()}
    for key, (one, other, *bad) in limits.items():
        for value in (one, other):
            assert getattr(check({**sound, key: value}), key) == value
        for value in bad:
            with pytest.raises(ValidationError):
                check({**sound, key: value})


def test_what_is_not_said_is_left_out() -> None:
    """A race is round, a motor has neither integral nor back-EMF; down is -y, as on Earth."""
    effects = effect_classes()
    assert effects["race_runout"]() == (0.0, 0.0, 0.0, 0.0)
    assert effects["motor"](1e-5, 1e-2, 1e-3)[3:] == (0.0, 0.0)
    assert effects["unequal_suspension"](1.0, 1.0, 1.0, 1.0).axis_angle == 0.0
    gx, gy = effects["gravity"](math.pi / 2).gravity()
    assert gx == pytest.approx(0.0, abs=1e-15) and gy == -9.80665


def test_whose_laws_contain_a_balls_radius_need_one() -> None:
    """A ball that rolls, or has a size."""
    need = {name for name, effect in effect_classes().items() if effect.uses_ball_radius}
    assert need == {"ball_contact", "ball_spin", "rolling_friction"}


EDGE = {"gravity": {"tilt": 1.2}}
UNEQUAL = {"stiffness_1": 0.5, "stiffness_2": 0.5, "damping_1": 0.0, "damping_2": 0.0}
LOOP = {"torque_limit": 1e-2, "proportional_gain": 1e-3}


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"suspension": {"stiffness": 0.5, "damping": 0.0}},
        {"suspension": None, "unequal_suspension": UNEQUAL},
        {"suspension": None, "hardening_suspension": {"cubic_stiffness": 0.5}},
        {"suspension": None, "gravity": {"tilt": 0.0}},
        {"suspension": None, "gravity": {"tilt": 1.2, "acceleration": 0.0}},
    ],
)
def test_a_deck_that_is_pulled_aside_needs_any_stiffness(
    scene: SceneMaker, effects: dict[str, Any]
) -> None:
    scene(effects={**EDGE, **effects})


@pytest.mark.parametrize(
    "effects",
    [
        {"suspension": None},
        {"suspension": {"stiffness": 0.0}},
        {"suspension": None, "hardening_suspension": {"cubic_stiffness": 0.0}},
        {"suspension": None, "gravity": {"tilt": 1.2, "acceleration": 1e-3}},
    ],
)
def test_a_deck_that_nothing_holds_is_not_pulled_aside(
    scene: SceneMaker, effects: dict[str, Any]
) -> None:
    with pytest.raises(SceneError, match="effects.gravity: pulls the deck"):
        scene(effects={**EDGE, **effects})


def test_a_deck_in_space_may_fall() -> None:
    loose = {"stiffness": 0.0, "damping": 0.0, "position": [0.0, 0.0, 0.0]}
    odd("smooth", {"effects": EDGE, "mounts": [loose]})


def test_there_is_one_linear_suspension(scene: SceneMaker) -> None:
    with pytest.raises(SceneError, match="unequal_suspension: replaces the effect"):
        scene(effects={"unequal_suspension": UNEQUAL})


def test_a_motor_turns_something_and_is_felt(scene: SceneMaker) -> None:
    scene(effects={"motor": {**LOOP, "rotor_inertia": 1e-6}})
    odd("smooth", {"effects": {"motor": {**LOOP, "rotor_inertia": 0.0}}})
    with pytest.raises(SceneError, match=r"rotor_inertia = 0\.0 kg m\^2: must be"):
        scene(effects={"motor": {**LOOP, "rotor_inertia": 0.0}})
    with pytest.raises(SceneError, match="effects.motor: needs .* spindle_acceleration"):
        scene(effects={"motor": {**LOOP, "rotor_inertia": 1e-6}, "spindle_acceleration": None})


@pytest.mark.parametrize("key", ["offset_1", "offset_2", "lobe"])
def test_a_race_goes_around_the_shaft(scene: SceneMaker, key: str) -> None:
    """Up to a quarter of its radius, 10 mm, with it."""
    for sign in (1.0, -1.0) if key != "lobe" else (1.0,):
        scene(effects={"race_runout": {key: sign * 2.5e-3}})
        with pytest.raises(SceneError, match=f"race_runout.{key} = .* at most a quarter"):
            scene(effects={"race_runout": {key: sign * 2.51e-3}})


def test_balls_touch_within_one_race() -> None:
    touching = {"ball_contact": {"restitution_coefficient": 0.5}}
    balls = {"count": 4, "mass": 2e-4, "radius": 1e-3}
    start = {"ball_angles": [0.0, 1.0, 2.0, 3.0], "ball_rates": None}
    odd("smooth", {"effects": touching, "balls": {**balls, "race": 0}, "start": start})
    for races in ([0, 0, 1, 1], [0, 1, 0, 0]):
        with pytest.raises(SceneError, match="contacts are not modelled"):
            odd("smooth", {"effects": touching, "balls": {**balls, "race": races}, "start": start})

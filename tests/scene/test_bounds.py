"""Bounds of numbers against what scenes say of the same values."""

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest
from pydantic import AfterValidator, TypeAdapter, ValidationError

from ab_sim.scene.bounds import Bounds, bounds_at
from ab_sim.scene.quantities import Number
from ab_sim.scene.registry import effect_classes
from ab_sim.scene.sections import Balls, Race, Rotor

NEAR = [0.0, 1e-12, 1e-9, 1e-3, 0.5, 1.0, 2.0, 10.0, 1e3, 1e6, 1e9, 1e12]
VALUES = [
    *(sign * value for value in NEAR for sign in (1.0, -1.0)),
    *(math.nextafter(value, towards) for value in NEAR for towards in (-math.inf, math.inf)),
    *(-1e-3, math.pi, 7.0, 1e300, math.inf, -math.inf, math.nan),
]


def allowed(kind: type[Any], name: str, value: float, others: dict[str, Any]) -> bool:
    try:
        TypeAdapter(kind).validate_python({**others, name: value})
    except ValidationError as error:
        return all(detail["loc"][:1] != (name,) for detail in error.errors())
    return True


@pytest.mark.parametrize("effect", effect_classes())
def test_bounds_of_effects_are_those_that_pydantic_checks(scene: Any, effect: str) -> None:
    """Field by field, without what effects ask of a scene as a whole."""
    kind = effect_classes()[effect]
    given = kind(**{name: 0.5 for name in kind._fields})
    made = scene().model_copy(update={"effects": {effect: given}})
    for name in kind._fields:
        bounds = bounds_at(made, f"effects.{effect}.{name}")
        if bounds is None:
            continue
        others = {other: 0.5 for other in kind._fields if other != name}
        wanted = [allowed(kind, name, value, others) for value in VALUES]
        assert bounds.hold(np.array(VALUES)).tolist() == wanted, name


@pytest.mark.parametrize(
    ("key", "rotor"),
    [
        ("rotor.eccentricity", {}),
        ("rotor.total_mass", {}),
        ("rotor.mass", {"total_mass": None, "mass": 0.1}),
        ("rotor.eccentric_mass", {"eccentric_mass": 0.05}),
        ("balls.mass", {}),
        ("race.radius", {}),
    ],
)
def test_bounds_of_sections_are_those_of_scenes(scene: Any, key: str, rotor: Any) -> None:
    bounds = bounds_at(scene(rotor=rotor), key)
    assert bounds is not None
    section, name = key.split(".")
    kind: type[Any] = {"rotor": Rotor, "balls": Balls, "race": Race}[section]
    others: dict[str, Any] = {"rotor": {"eccentricity": 1e-4}, "balls": {"count": 2}}.get(
        section, {}
    )
    wanted = [allowed(kind, name, value, others) for value in VALUES]
    assert bounds.hold(np.array(VALUES)).tolist() == wanted


def test_of_other_keys_nothing_is_said(scene: Any) -> None:
    made = scene()
    for key in (
        *("rotor.mass", "rotor.height", "start.speed", "balls.count", "balls.radius", "duration"),
        *("effects.suspension", "effects.suspension.count", "effects.gravity.tilt", "effects", ""),
        "effects.suspension.stiffness.more",
    ):
        assert bounds_at(made, key) is None, key
    assert bounds_at(made, "effects.suspension.stiffness") == Bounds(least=0.0, most=1e12)


class Whole(NamedTuple):
    """An effect with a condition that bounds cannot express."""

    number: Annotated[Number, AfterValidator(round)] = 2.0


def test_a_condition_other_than_bounds_is_not_passed_over(scene: Any) -> None:
    changed = scene().model_copy(update={"effects": {"whole": Whole()}})
    assert bounds_at(changed, "effects.whole.number") is None

"""Maps for several values of a third parameter."""

import numpy as np
import pytest

from ab_sim.analysis.maps.family import family, members, values_of
from ab_sim.analysis.maps.plane import Plane, axes_of
from ab_sim.analysis.maps.stability import stability_map
from ab_sim.base.errors import InputError, SceneError
from ab_sim.scene import load_scene

DRAG = "effects.viscous_drag.coefficient"
AXES = "speed=150:400:9,effects.suspension.damping=1:60:9"


def plane(*changes: str) -> Plane:
    return Plane(load_scene("nsc-case-3", ["balls.mass=0.0006", *changes]), 0.0, *axes_of(AXES))


def test_each_map_is_that_of_the_changed_scene_and_drag_widens_balance() -> None:
    found = family(plane(), DRAG, (0.008, 0.2), 4)
    alone = stability_map(plane(f"{DRAG}=0.2"), 4)
    np.testing.assert_array_equal(found.maps[1].labels, alone.labels)
    little, much = (each.balanced for each in found.maps)
    assert not (little & ~much).any() and 0.0 < little.mean() < 0.7 * much.mean()
    report = found.report()
    assert report["key"] == DRAG and report["values"] == [0.008, 0.2]
    assert [len(each["labels"]) for each in report["maps"]] == [9, 9]


def test_values() -> None:
    assert values_of(" a.b =1,2e-3") == ("a.b", (1.0, 0.002))


@pytest.mark.parametrize("text", ["a", "a=", "=1,2", "a=1,x", "a=1,nan", "a=1,inf", "a=1,1"])
def test_values_that_are_none(text: str) -> None:
    with pytest.raises(InputError, match="must be"):
        values_of(text)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("speed", 3.0, "each speed: is on an axis, or the spindle's speed"),
        ("effects.suspension.damping", 3.0, "is on an axis"),
        (DRAG, -1.0, f"{DRAG} = -1"),
        ("balls.masss", 1.0, "did you mean 'mass'?"),
    ],
)
def test_keys_that_cannot_be_varied(key: str, value: float, words: str) -> None:
    with pytest.raises((InputError, SceneError)) as error:
        members(plane(), key, (value,))
    assert words in str(error.value)

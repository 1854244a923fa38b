"""Effects as scenes see them: parameters with and without defaults, and effects that refuse."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import pytest
from pydantic import TypeAdapter

import ab_sim
from ab_sim.base.errors import AbSimError, InputError, SceneError
from ab_sim.cli.lists import print_effects
from ab_sim.cli.scene_commands import EffectsOptions
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.scene import Scene, check_scene, load_scene
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import effect_classes, effect_parameters, register


class Magnets(NamedTuple):
    """Attract the balls."""

    strength: Annotated[Number, quantity("B", "T", ge=0, le=5)] = 0.25
    angle: Annotated[Number, quantity("phi", "rad")] = -1.5707963267948966

    def check_scene(self, scene: Scene) -> None:
        if self.strength > 0 and "viscous_drag" not in scene.effects:
            raise ValueError(
                f"effects.magnets.strength = {self.strength:g}: must be 0 without the effect "
                "viscous_drag; add it, or set the strength to 0"
            )


@pytest.fixture
def magnets() -> Iterator[None]:
    """An effect all of whose parameters have defaults, and which refuses scenes without drag."""
    with ab_sim.temporary_registrations():
        register("magnets", equation="F = B", source="nowhere (1)")(Magnets)
        yield


def with_effects(scene: Any, *more: Any) -> Scene:
    mapping = scene().as_mapping()
    effects = [{name: parameters} for name, parameters in mapping["effects"].items()]
    return check_scene({**mapping, "effects": [*effects, *more]}, "test")


def test_a_bare_name_takes_the_defaults(scene: Any, magnets: None) -> None:
    bare = with_effects(scene, "magnets")
    assert bare.effects["magnets"] == (0.25, Magnets().angle)
    assert with_effects(scene, {"magnets": {"angle": 1}}).effects["magnets"] == (0.25, 1.0)
    assert bare.as_mapping()["effects"]["magnets"] == Magnets()._asdict()
    assert check_scene(bare.as_mapping(), "again") == bare
    assert load_scene("thesis-hold", ["effects.magnets.angle=2"]).effects["magnets"].angle == 2.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"strength": 6}, "effects.magnets.strength = 6: must be at most 5; B [T]"),
        (
            {"strength": "lots"},
            "effects.magnets.strength = 'lots': must be a number, in T or with a unit, e.g. 0.5 T; "
            "B [T]",
        ),
        (
            {"strenght": 1},
            "effects.magnets.strenght = 1: not known here; did you mean 'strength'?; "
            "allowed here: strength, angle",
        ),
    ],
)
def test_errors_in_parameters_with_defaults(
    scene: Any, magnets: None, given: Any, words: str
) -> None:
    with pytest.raises(SceneError) as caught:
        with_effects(scene, {"magnets": given})
    assert str(caught.value) == f"test: {words}"


def test_an_effect_can_refuse_a_scene(scene: Any, magnets: None) -> None:
    mapping = with_effects(scene, "magnets").as_mapping()
    del mapping["effects"]["viscous_drag"]
    with pytest.raises(SceneError) as caught:
        check_scene(mapping, "test")
    assert str(caught.value) == (
        "test: effects.magnets.strength = 0.25: must be 0 without the effect viscous_drag; add "
        "it, or set the strength to 0"
    )
    mapping["effects"]["magnets"]["strength"] = 0.0
    check_scene(mapping, "test")


def test_an_effect_is_not_asked_about_a_scene_that_is_wrong_anyhow(
    scene: Any, magnets: None
) -> None:
    mapping = with_effects(scene, "magnets").as_mapping()
    del mapping["effects"]["viscous_drag"]
    mapping["balls"]["mass"] = -1.0
    with pytest.raises(SceneError) as caught:
        check_scene(mapping, "test")
    assert "balls.mass" in str(caught.value) and "magnets" not in str(caught.value)


def test_a_disc_that_lies_flat_needs_nothing_to_hold_it(scene: Any) -> None:
    def tilted(tilt: float) -> Scene:
        return scene(effects={"suspension": None, "gravity": {"tilt": tilt}})

    flat = tilted(0.0)
    assert choose_stepper(flat, system_of(flat)).stepper.name == "rk8"
    with pytest.raises(SceneError, match=r"0\.979 m/s\^2, and no suspension"):
        tilted(0.1)


def test_a_printed_effect_shows_its_defaults(
    magnets: None, capsys: pytest.CaptureFixture[str]
) -> None:
    print_effects(EffectsOptions("magnets"))
    printed = capsys.readouterr().out
    assert "B [T]; default 0.25" in printed and "phi [rad]; default -1.5708" in printed
    assert "suspension" not in printed


def test_an_effect_that_is_not_there_is_not_printed() -> None:
    with pytest.raises(InputError, match="'suspensoin': .* mean 'suspens"):
        print_effects(EffectsOptions("suspensoin"))


@pytest.mark.parametrize(("name", "effect"), effect_classes().items())
def test_defaults_are_what_checking_makes_of_them(name: str, effect: Any) -> None:
    """An int for a float would have a kernel compiled of its own."""
    defaults = effect._field_defaults
    assert {key for key, field in effect_parameters(effect).items() if "default" in field} == {
        *defaults
    }
    given = dict.fromkeys(effect._fields, 0.5) | defaults
    checked = TypeAdapter(effect).validate_python(given)._asdict()
    for key, default in defaults.items():
        assert (checked[key], type(checked[key])) == (default, type(default)), key


def test_two_effects_whose_classes_have_one_name_are_refused(magnets: None) -> None:
    """Compiled, the one that comes second would be computed by the law of the first."""

    class Suspension(NamedTuple):
        """Another law."""

        stiffness: Annotated[Number, quantity("k", "N/m")]
        damping: Annotated[Number, quantity("c", "N s/m")]

    with pytest.raises(ValueError, match="'springs': .* Suspension.*'suspension'"):
        register("springs", equation="f = 0", source="nowhere")(Suspension)
    assert "springs" not in effect_classes()


@pytest.mark.parametrize(
    ("hook", "gives", "words"),
    [
        ("deck_force", 1.0, "Rough.deck_force returns a number"),
        ("deck_force", (1.0, 0.0, 0.0), "Rough.deck_force returns a tuple of 3"),
        ("deck_force", None, "Rough.deck_force returns nothing; .* tuple of 2"),
        ("ball_drag", (1.0, 0.0), "Rough.ball_drag returns a tuple of 2"),
        ("deck_force", (math.nan, 0.0), "deck's whirl .* finite.*Rough"),
        ("ball_drag", math.inf, "race's drag .* finite.*Rough"),
    ],
)
def test_what_an_effect_returns_is_checked(scene: Any, hook: str, gives: Any, words: str) -> None:
    class Rough(NamedTuple):
        """Returns what it should not."""

    setattr(Rough, hook, lambda *_: gives)
    with ab_sim.temporary_registrations():
        register("rough", equation="f = ?", source="nowhere")(Rough)
        rough = with_effects(scene, "rough")
        with pytest.raises(AbSimError, match=words):
            choose_stepper(rough, system_of(rough))

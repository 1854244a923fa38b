"""What holds for every registered effect, whatever it does, and what a kernel is made of."""

import inspect
import re
from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.engine.kernels.constants import layout_of_constants, replace_floats
from ab_sim.engine.kernels.emission import Emission
from ab_sim.engine.kernels.model import Model
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.equations import effects
from ab_sim.model.equations.effects import RollingFriction, Suspension, ViscousDrag
from ab_sim.model.equations.motion import Ball, DeckMotion
from ab_sim.model.equations.sums import any_has, over_effects
from ab_sim.model.spindle import Ramp
from ab_sim.scene import check_scene
from ab_sim.scene.registry import effect_classes, effect_parameters
from ab_sim.tracing import Expression, Graph, lowered
from ab_sim.tracing.expression import reachable_nodes
from tests.conftest import THESIS, merge
from tests.effects.parts import NO_LOSSES, scene_of
from tests.tracing.plain import python_function

METHODS = set(re.findall(r"(\w+)\(self", effects.__doc__ or "")) - {"check_scene"}
"""What an effect may have; the folder's documentation is the list."""


@pytest.mark.parametrize(("name", "effect"), effect_classes().items())
def test_effects_are_documented(name: str, effect: Any) -> None:
    assert effect.__doc__ and effect.equation and effect.source
    for key, field in effect_parameters(effect).items():
        assert field["description"] and field["unit"], key
    own = {key for key in vars(effect) if callable(vars(effect)[key]) and not key.startswith("_")}
    own -= {"check_scene"}
    assert own, "it does something"
    assert own <= METHODS, "and nothing that no kernel would call"


def test_every_effect_is_exported() -> None:
    """Else users could not import it from the package that documents effects."""
    assert {effect.__name__ for effect in effect_classes().values()} == set(effects.__all__)


def test_every_documented_method_is_of_some_effect() -> None:
    assert len(METHODS) > 15
    found = {key for effect in effect_classes().values() for key in vars(effect)}
    assert METHODS <= found


def test_sums_leave_out_effects_without_the_method() -> None:
    smooth = (Suspension(1.0, 1.0), ViscousDrag(1.0))
    assert over_effects(smooth, "ball_inertia", 0.0, Ball(1.0, 1.0)) == 0.0
    both = (RollingFriction(0.1), Suspension(1.0, 1.0), RollingFriction(0.2))
    found = over_effects(both, "friction_coefficient", 0.0, Ball(1.0, 1.0))
    assert found == pytest.approx(0.3)
    assert any_has(both, "ball_drag") is False


HALVES: tuple[dict[str, Any], ...] = (
    {
        "suspension": {"stiffness": 1000.0, "damping": 0.2},
        "viscous_drag": {"coefficient": 1.0},
        "ball_spin": {},
        "hardening_suspension": {"cubic_stiffness": 1e8},
        "gravity": {"tilt": 1.0},
        "race_runout": {"lobe": 1e-5},
    },
    {
        "spindle_acceleration": {},
        "unequal_suspension": {
            "stiffness_1": 1000.0,
            "stiffness_2": 1000.0,
            "damping_1": 0.2,
            "damping_2": 0.2,
        },
        "rolling_friction": {"arm": 1e-6},
        "race_friction": {"coefficient": 0.01},
        "ball_contact": {"restitution_coefficient": 0.5},
        "motor": {"rotor_inertia": 2e-5, "torque_limit": 1e-2, "proportional_gain": 1e-3},
    },
)
"""Each effect is in one of them and not in the other; the first has no events."""


def half_of(name: str) -> int:
    """Which of the halves has an effect."""
    found = [at for at, half in enumerate(HALVES) if name in half]
    assert len(found) == 1, f"{name}: has to be in one of HALVES in tests/dynamics/test_effects.py"
    return found[0]


MOVING: dict[str, Any] = {"deck": DeckMotion(3e-4, -2e-4, 0.05, 0.04), "ball": Ball(1e-3, 2e-3)}
"""Arguments by name; others are numbers."""


@pytest.mark.parametrize("name", effect_classes())
def test_an_effect_computes_and_does_nothing_else(name: str) -> None:
    """As the folder's documentation says: the same with floats, and traced."""
    half = HALVES[half_of(name)]
    effect = check_scene({**THESIS, "effects": half}, "test").effects[name]
    for method in METHODS & set(vars(type(effect))):
        names = list(inspect.signature(getattr(effect, method)).parameters)
        arguments = tuple(MOVING.get(key, 0.3 + 0.1 * i) for i, key in enumerate(names))
        result = getattr(effect, method)(*arguments)
        assert result == getattr(effect, method)(*arguments)
        numbers = result if isinstance(result, tuple) else (result,)
        assert {type(number) for number in numbers} == {float}
        given: dict[str, float] = {}
        this, those = replace_floats((effect, arguments), "x", _input(Graph(), given))
        made = getattr(this, method)(*those)
        roots = [x for x in (made if isinstance(made, tuple) else (made,))]
        inputs = {key: f"v{k}" for k, key in enumerate(given)}
        values = {f"v{k}": value for k, value in enumerate(_floats((effect, arguments)))}
        expressions = lowered([x for x in roots if isinstance(x, Expression)])
        found = iter(python_function(expressions, inputs)(**values))
        both = [next(found) if isinstance(x, Expression) else x for x in roots]
        np.testing.assert_allclose(both, numbers, rtol=1e-12)


def _input(graph: Graph, given: dict[str, float]) -> Any:
    def make(name: str) -> Expression:
        given[name] = 0.0
        return graph.input(name)

    return make


def _floats(value: Any) -> list[float]:
    if isinstance(value, tuple):
        return [number for part in value for number in _floats(part)]
    return [value] if isinstance(value, float) else []


def emission_of(chosen: dict[str, Any]) -> Emission:
    """What is emitted for the thesis' drive with these effects."""
    system = system_of(check_scene({**THESIS, "effects": chosen}, "test"))
    layout = layout_of_constants(system, Ramp)
    return Emission(Model(system, Ramp), layout, Ramp._fields)


def parameters_used(emission: Emission) -> set[str]:
    """Inputs that something depends on that is emitted."""
    roots = [x for group in emission.roots.values() for x in group]
    return {str(x.payload) for x in reachable_nodes(roots) if x.op == "input"}


@pytest.mark.parametrize("name", effect_classes())
def test_what_a_scene_does_not_name_is_not_computed(name: str) -> None:
    """Its parameters are in the code of the half that names it; without it the code is shorter."""
    half = HALVES[half_of(name)]
    emission = emission_of(half)
    used = parameters_used(emission)
    own = [key for key in effect_classes()[name]._fields if key != "rest_speed"]
    kinds = [type(effect) for effect in emission.model.effects]
    place = kinds.index(effect_classes()[name])
    expected = {f".1.{place}.{key}" for key in own}
    # The law of impact is emitted by itself, and called at impacts.
    assert expected <= used or name == "ball_contact"
    others = {key for key in used if key.startswith(".1.")}
    places = {int(key.split(".")[2]) for key in others}
    assert places <= set(range(len(half)))
    alone = {key: value for key, value in half.items() if key != name}
    if name in ("motor", "spindle_acceleration"):
        alone.pop("motor", None)
    if name == "spindle_acceleration":
        # A motor asks for it.
        half = {key: value for key, value in half.items() if key != "motor"}
    sizes = []
    for chosen in (half, alone):
        own_code = emission_of(chosen)
        made = own_code.prepare(), own_code.slope()
        sizes.append(sum(len(function.lines) for function in made))
    if name in ("ball_contact", "ball_spin"):
        # An impact is code of its own; a ball's spin is in its constants, and costs nothing at all.
        assert sizes[0] >= sizes[1]
    else:
        assert sizes[0] > sizes[1]


def test_a_scene_without_events_has_no_code_for_them() -> None:
    without, with_events = (emission_of(half) for half in HALVES)
    assert "table" not in without.roots and "block" not in without.roots
    assert "table" in with_events.roots and "block" in with_events.roots
    assert not {"sign", "rows", "limit", "mobility_now"} & parameters_used(without)
    assert {"sign", "limit"} <= parameters_used(with_events)


def test_without_spindle_acceleration_only_its_terms_are_missing(scene: Any) -> None:
    """At constant speed nothing changes; during the run-up balls are not left behind."""
    held = {"profile": None, "start": {"speed": 80.0, "ball_angles": [0.3, -0.9]}}
    one, other = (
        Drive(scene(**held, effects=effects)).advance(1000)
        for effects in ({}, {"spindle_acceleration": None})
    )
    np.testing.assert_array_equal(one.samples, other.samples)
    run_up, without = (
        Drive(scene(effects=effects)).advance(200).ball_rates[-1]
        for effects in ({}, {"spindle_acceleration": None})
    )
    # Lag of a ball that is dragged along: (mu - spin) al / c_b, spin (R + a)/R times I/a^2.
    lag = (1.4e-3 - 0.4e-3 * 1.1) * 40.0 / 1.0
    np.testing.assert_allclose(run_up, -lag, rtol=0.1)
    assert np.abs(without).max() < 0.1 * lag


def test_balance_with_friction_closes_over_a_whole_start_up(with_hold: Any) -> None:
    """Events are located: it closes as closely as without friction."""
    scene = scene_of(
        "friction",
        {
            "start": {"speed": 0.0},
            "profile": with_hold(target_speed=200.0, start_speed=100.0, duration=0.5),
            "effects": {"rolling_friction": {"arm": 5e-6}},
        },
    )
    drive = Drive(scene, energy_balance=True)
    for _ in range(60):
        drive.advance(100)
        energy = drive.energy()
        residual = energy.stored - energy.at_start - energy.motor_work + energy.dissipated
        assert abs(residual) < 1e-10 * energy.stored
    assert drive.events > 5 and drive.steps_with_unresolved_events == 0
    drag_only = Drive(
        check_scene(merge(scene.as_mapping(), NO_FRICTION), "test"), energy_balance=True
    )
    drag_only.advance(6000)
    assert abs(energy.dissipated / drag_only.energy().dissipated - 1) > 1e-3, "it rubbed"


NO_FRICTION = {"effects": {"rolling_friction": {"arm": 0.0}}}


def test_energy_balance_over_a_whole_start_up(scene: Any, with_hold: Any) -> None:
    """Friction off: closes to 1e-10 of the energy at every instant looked at."""
    drive = Drive(
        scene(
            start={"ball_angles": [0.3, -0.9]},
            profile=with_hold(target_speed=200.0, start_speed=100.0, duration=0.5),
        ),
        energy_balance=True,
    )
    for _ in range(60):
        drive.advance(100)
        energy = drive.energy()
        residual = energy.stored - energy.at_start - energy.motor_work + energy.dissipated
        assert abs(residual) < 1e-10 * energy.stored
    assert energy.motor_work > 0 and energy.dissipated > 0


def test_undamped_drive_conserves_energy_at_constant_speed(scene: Any) -> None:
    """No drag, no damping, constant speed: only the motor's work changes the energy."""
    drive = Drive(
        scene(
            effects=NO_LOSSES["thesis"],
            start={"speed": 120.0, "ball_angles": [0.3, -0.9]},
            profile=None,
        ),
        energy_balance=True,
    )
    drive.advance(5000)
    energy = drive.energy()
    assert energy.dissipated == 0.0
    assert energy.stored - energy.at_start == pytest.approx(energy.motor_work, rel=1e-9)

"""What holds for every registered effect, whatever it does, and what a kernel is made of."""

import inspect
import re
from typing import Any

import numba
import numpy as np
import pytest
from numba.extending import register_jitable

from ab_sim.drive import Drive
from ab_sim.dynamics import effects
from ab_sim.dynamics.assemble import start_modes, start_state, state_bounds, system_of
from ab_sim.dynamics.dispatch import APART, any_effect_has, forward, sum_over_effects
from ab_sim.equations.effects import RollingFriction, Suspension, ViscousDrag
from ab_sim.equations.motion import Ball, Deck
from ab_sim.dynamics.numbers.lanes import LANES, as_lanes, leaves, spread
from ab_sim.dynamics.system import Place, has_events
from ab_sim.integrate.fixed_step import Run, advance
from ab_sim.integrate.kept import Kept
from ab_sim.integrate.steppers.rk8 import RK8
from ab_sim.integrate.workspace import aligned, workspace
from ab_sim.scene import check_scene
from ab_sim.scene.registry import effect_classes, effect_parameters
from ab_sim.spindle import Ramp
from tests.conftest import THESIS, merge
from tests.effects.parts import NO_LOSSES, scene_of

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


def test_every_documented_method_is_of_some_effect() -> None:
    assert len(METHODS) > 15
    found = {key for effect in effect_classes().values() for key in vars(effect)}
    assert METHODS <= found


def test_sums_leave_out_effects_without_the_method() -> None:
    inertia = sum_over_effects("ball_inertia", 0.0)
    assert inertia((Suspension(1.0, 1.0), ViscousDrag(1.0)), Ball(1.0, 1.0)) == 0.0
    friction = sum_over_effects("friction_coefficient", 0.0)
    both = (RollingFriction(0.1), Suspension(1.0, 1.0), RollingFriction(0.2))
    assert friction(both, Ball(1.0, 1.0)) == pytest.approx(0.3)
    assert any_effect_has("ball_drag")(both) is False


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


MOVING: dict[str, Any] = {"deck": Deck(3e-4, -2e-4, 0.05, 0.04), "ball": Ball(1e-3, 2e-3)}
"""Arguments by name; others are numbers."""


def scaled(values: Any, factor: float) -> Any:
    """Nested tuples with all their floats changed, and nothing else."""
    if isinstance(values, tuple):
        parts = [scaled(value, factor) for value in values]
        return type(values)(*parts) if hasattr(values, "_fields") else tuple(parts)
    return values * factor if isinstance(values, float) else values


def in_lanes(
    method: str, count: int, thing: Any, arguments: tuple[Any, ...], factors: list[float]
) -> Any:
    """What compiled code makes of a method with the floats times each factor, side by side."""
    call = forward(method)
    several = register_jitable((lambda result: result) if count > 1 else (lambda result: (result,)))

    @numba.njit(error_model="numpy")
    def run(thing, arguments, table, out):  # type: ignore[no-untyped-def]
        this, given = spread((thing, arguments), as_lanes(table))
        result = several(call(this, *given))
        for i in range(count):
            as_lanes(out)[i] = result[i]

    numbers = leaves((thing, arguments))
    table, out = aligned((len(numbers), LANES)), aligned((count, LANES))
    table[:] = np.outer(numbers, factors)
    run(thing, arguments, table, out)
    return out


@pytest.mark.parametrize("name", effect_classes())
def test_an_effect_computes_and_does_nothing_else(name: str) -> None:
    """As the folder's documentation says: the same compiled, and unless it has events in lanes."""
    (half,) = [half for half in HALVES if name in half]
    effect = check_scene({**THESIS, "effects": half}, "test").effects[name]
    factors = [1.0 + 0.01 * lane for lane in range(LANES)]
    for method in METHODS & set(vars(type(effect))):
        names = list(inspect.signature(getattr(effect, method)).parameters)
        arguments = tuple(MOVING.get(key, 0.3 + 0.1 * i) for i, key in enumerate(names))
        expected = []
        for factor in factors:
            this, given = scaled((effect, arguments), factor)
            result = getattr(this, method)(*given)
            assert result == getattr(this, method)(*given)
            numbers = result if isinstance(result, tuple) else (result,)
            assert {type(number) for number in numbers} == {float}
            expected.append(numbers)
        count = len(numbers)
        if has_events((effect,)):
            compiled = numba.njit(error_model="numpy")(getattr(type(effect), method))
            found = np.reshape(compiled(effect, *arguments), (count, 1))
        else:
            found = in_lanes(method, count, effect, arguments, factors)
        np.testing.assert_allclose(found, np.transpose(expected[: found.shape[1]]), rtol=1e-12)


@pytest.fixture(scope="module")
def kernels() -> list[tuple[str, str]]:
    """Of both halves, the types that the kernel is compiled for, and its code."""
    made = []
    for half in HALVES:
        scene = check_scene({**THESIS, "effects": half}, "test")
        system = system_of(scene)
        state, modes = start_state(scene, system), start_modes(scene, system)
        work = workspace(system, RK8, state_bounds(system, 1e-3))
        place = Place(Ramp(0.0, 40.0), 0.0)
        kept = Kept(Run(system, place, RK8.weights, 1e-3, state, modes, work, 0))
        arguments = (kept, np.empty((1, 10)), 0, 0, 1, 0.0, np.empty((1, 20)))
        # Compiled afresh: code that came from the disk cache cannot be inspected.
        fresh = numba.njit(**APART)(advance.py_func)
        signature = tuple(numba.typeof(argument) for argument in arguments)
        fresh.compile(signature)
        made.append((str(signature[0]), fresh.inspect_llvm(signature)))
    return made


@pytest.mark.parametrize("name", effect_classes())
def test_what_a_scene_does_not_name_is_not_in_its_kernel(
    name: str, kernels: list[tuple[str, str]]
) -> None:
    """Its class is not among the types that the kernel is compiled for, nor in its code."""
    effect = effect_classes()[name]
    word = re.compile(rf"(?<![A-Za-z]){effect.__name__}(?![A-Za-z])")
    assert sum(name in half for half in HALVES) == 1
    for half, (types, code) in zip(HALVES, kernels, strict=True):
        assert bool(word.search(types)) == (name in half)
        assert (effect.__name__ in types) == (effect.__name__ in code)


def test_kernel_without_events_does_not_look_for_any(kernels: list[tuple[str, str]]) -> None:
    (_, without), (_, events) = kernels
    for what in (".callback.", "step_with_events", "enter", "look_back"):
        assert what in events and what not in without


def test_what_happens_at_events_is_compiled_for_no_scene(kernels: list[tuple[str, str]]) -> None:
    """A kernel has its equations, and calls the rest where it has been compiled once for all."""
    for _, code in kernels:
        assert "evaluate" in code
        for what in ("settle", "collide", "margins", "locate"):
            assert what not in code


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
    drive = Drive(scene, ledger=True)
    for _ in range(60):
        drive.advance(100)
        energy = drive.energy()
        residual = energy.stored - energy.at_start - energy.motor_work + energy.dissipated
        assert abs(residual) < 1e-10 * energy.stored
    assert drive.events > 5 and drive.crowded_steps == 0
    drag_only = Drive(check_scene(merge(scene.as_mapping(), NO_FRICTION), "test"), ledger=True)
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
        ledger=True,
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
        ledger=True,
    )
    drive.advance(5000)
    energy = drive.energy()
    assert energy.dissipated == 0.0
    assert energy.stored - energy.at_start == pytest.approx(energy.motor_work, rel=1e-9)

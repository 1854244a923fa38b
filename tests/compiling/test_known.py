"""Fields whose value is known: what is then not reached is not in the code."""

from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any, NamedTuple

import pytest

import ab_sim
from ab_sim.engine.compiling import compiled
from ab_sim.engine.compiling.library import Module
from ab_sim.engine.compiling.source import for_class
from ab_sim.engine.integrate.steppers.rk8 import RK8
from ab_sim.engine.kernels.code import code_of
from ab_sim.engine.stepping.advance import advance
from ab_sim.engine.stepping.assemble import flags_of, run_of
from ab_sim.engine.stepping.fixed_step import FixedSteps
from ab_sim.model.dynamics.assemble import (
    start_discrete_state,
    start_state,
    state_bounds,
    system_of,
)
from ab_sim.model.spindle import Ramp


class Switches(NamedTuple):
    doubled: bool
    shifted: bool


class Given(NamedTuple):
    x: float
    switches: Switches


def doubled(x: float) -> float:
    return 2.0 * x


def shifted(x: float) -> float:
    return x + 1.0


def changed(given: Given, least: float) -> float:
    x = given.x
    if not given.switches.doubled:
        x = x - 0.5
    else:
        x = doubled(x)
    x = shifted(x) if given.switches.shifted else x
    if given.switches.shifted and x > shifted(least):
        x = 0.25
    if given.switches.shifted or x > least:
        x = 3.0 * x
    return x


@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("shift", [False, True])
@pytest.mark.parametrize("x", [-3.0, 0.75, 8.0])
def test_what_is_known_changes_no_result(double: bool, shift: bool, x: float) -> None:
    given = Given(x, Switches(double, shift))
    expected = changed(given, 1.0)
    for known in ({}, {"doubled": double}, {"shifted": shift, "doubled": double}):
        assert compiled(changed, known)(given, 1.0) == expected


def text_of(function: Callable[..., Any], known: Mapping[str, bool]) -> str:
    assert isinstance(function, FunctionType)
    return Module(function, known).text()


def test_what_is_not_reached_is_not_there() -> None:
    for known, there in (
        ({}, ("doubled", "shifted")),
        ({"doubled": False}, ("shifted",)),
        ({"doubled": True, "shifted": False}, ("doubled",)),
        ({"doubled": False, "shifted": False}, ()),
    ):
        text = text_of(changed, known)
        assert tuple(f for f in ("doubled", "shifted") if f".{f}." in text) == there


@pytest.mark.parametrize(
    ("scene", "without"),
    [
        ("no-ball", ("events.location.locate", "events.impact")),
        ("thesis-hold", ("events.impact",)),
        ("packed-balls", ()),
    ],
)
def test_a_driver_has_only_what_its_scene_calls_for(scene: str, without: tuple[str, ...]) -> None:
    loaded = ab_sim.load_scene(scene)
    system, step = system_of(loaded), 1e-3
    code = code_of(system, Ramp)
    state, discrete = start_state(loaded, system), start_discrete_state(loaded, system)
    bounds = state_bounds(system, step)
    run = run_of(system, code, code.step(RK8.weights), step, state, discrete, bounds)
    loop = for_class(advance, FixedSteps)  # type: ignore[arg-type]
    text = text_of(loop, flags_of(run))
    everything = text_of(loop, {})
    for part in ("events.location.locate", "events.impact"):
        assert part in everything
        assert (part in text) is (part not in without)

"""Balls side by side on any race: placing, checking and running measure with one gap."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ab_sim.base.errors import SceneError
from ab_sim.engine.events.balls import gap, put_branches
from ab_sim.engine.events.run_arrays import balls_of
from ab_sim.engine.kernels.code import called, code_of
from ab_sim.model.dynamics.assemble import start_discrete_state, start_state, system_of
from ab_sim.model.dynamics.system import JOINED, SPACING
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.model.spindle import Ramp
from ab_sim.scene import Scene
from tests.effects.parts import scene_of
from tests.reference.contact import chain_of
from tests.reference.model import Model
from tests.reference.of_scene import params_of


def crowd(runout: dict[str, float], angles: list[float] | None, *radii: float) -> Scene:
    """Balls of these radii [m] on a race of 10 mm."""
    balls: dict[str, Any] = {"count": len(radii), "mass": 1e-4, "radius": list(radii)}
    start: dict[str, Any] = {"ball_angles": angles}
    return scene_of("all", {"balls": balls, "start": start, "effects": {"race_runout": runout}})


def gaps(scene: Scene) -> np.ndarray:
    """Of the law that runs, at the start, over the spacing; the row's ends come last."""
    system = system_of(scene)
    state, discrete_state = start_state(scene, system), start_discrete_state(scene, system)
    code, balls = code_of(system, Ramp), balls_of(system, discrete_state)
    put_branches(balls)
    c, slope = code.constants(system), np.zeros(len(state))
    code.put_place(c, [0.0] * 5)
    arrays = c, balls.branches, state, slope, balls.x, balls.motor, balls.table
    called(code.address("evaluate"), *arrays, 0.0)
    found = [gap(balls, k) for k in range(len(system.contacts))]
    return np.array(found) / system.contacts[:, SPACING]


LENGTH = st.floats(-2.5e-3, 2.5e-3)
RADII = st.lists(st.floats(2e-4, 3e-3), min_size=2, max_size=9)


@settings(max_examples=100)
@given(LENGTH, LENGTH, st.floats(0.0, 2.5e-3), st.floats(-6.2, 6.2), RADII)
def test_a_packed_row_has_no_gaps_and_no_overlap(
    offset_1: float, offset_2: float, lobe: float, lobe_angle: float, radii: list[float]
) -> None:
    """On races off the shaft axis and oval ones up to the largest that are allowed."""
    runout = {
        "offset_1": offset_1, "offset_2": offset_2, "lobe": lobe, "lobe_angle": lobe_angle
    }  # fmt: skip
    if sum(radii) > 2.5e-2:
        radii = radii[:4]
    scene = crowd(runout, None, *radii)
    found = gaps(scene)
    assert np.abs(found[:-1]).max() < 1e-12 and found[-1] > 0.0
    system = system_of(scene)
    assert start_discrete_state(scene, system)[: len(radii), JOINED].tolist() == [1] * (
        len(radii) - 1
    ) + [0]
    chain = chain_of(Model(params_of(scene)), np.array(start_angles(scene)))
    others = chain.gaps(np.array(start_angles(scene))) / chain.closest
    np.testing.assert_allclose(np.sort(others), np.sort(found), rtol=0.0, atol=1e-12)


def test_balls_are_measured_along_the_race_wherever_they_start() -> None:
    """0.18 rad apart: too close where an oval is bent most, free where it is flattest."""
    oval, need = {"lobe": 1e-3, "lobe_angle": 0.4}, 2e-2 * np.arcsin(0.1)
    bent, flat = 1.8e-3 - 3e-3 * np.sin(0.18), 1.8e-3 + 3e-3 * np.sin(0.18)
    with pytest.raises(SceneError) as caught:
        crowd(oval, [0.31, 0.49], 1e-3, 1e-3)
    assert "balls 0 and 1 overlap at the start" in str(caught.value)
    assert f"{bent:.6g} m apart along the race" in str(caught.value)
    assert f"they need {need:.6g} m" in str(caught.value)
    across = [0.31 + np.pi / 2, 0.49 + np.pi / 2]
    assert gaps(crowd(oval, across, 1e-3, 1e-3))[0] == pytest.approx(flat / need - 1.0)


@pytest.mark.parametrize("angles", [[3.1, -3.1], [-3.1, 3.1], [0.0, 2 * np.pi], [7.0, 0.7]])
def test_balls_that_overlap_across_a_turn_are_refused_with_their_distance(
    angles: list[float],
) -> None:
    apart = 1e-2 * abs((angles[1] - angles[0] + np.pi) % (2 * np.pi) - np.pi)
    with pytest.raises(SceneError, match="overlap at the start") as caught:
        crowd({}, angles, 1e-3, 1e-3)
    told = float(str(caught.value).split("at the start, ")[1].split(" m")[0])
    assert told == pytest.approx(apart, rel=1e-5, abs=1e-15)


def test_balls_that_do_not_fit_are_told_the_length_of_the_race() -> None:
    with pytest.raises(SceneError, match=r"0\.06411 m of .* 0\.06283 m"):
        crowd({"lobe": 2e-3}, None, *[1e-3] * 32)


def test_a_race_that_is_not_convex_is_refused_before_balls_are_placed_on_it() -> None:
    with pytest.raises(SceneError, match="race_runout.lobe = 0.008 m: .* a quarter"):
        crowd({"lobe": 8e-3}, None, *[1e-3] * 8)

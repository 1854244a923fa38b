"""Results in the units of who reads them; what is computed and written stays in SI."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import ab_sim
from ab_sim.base.errors import InputError
from ab_sim.design.sweep import Sweep
from ab_sim.scene.units import shown_units

SHORT = ["duration=0.2"]


def test_units_turn_si_numbers_into_theirs() -> None:
    units = shown_units("rpm, g mm,deg, in/s")
    assert units["rad/s"].factor == pytest.approx(30.0 / np.pi, rel=1e-15)
    assert units["kg m"].factor == pytest.approx(1e6, rel=1e-15)
    assert units["rad"].text == "deg"
    assert units["mm/s"].factor == pytest.approx(1.0 / 25.4, rel=1e-15)
    assert shown_units(" ") == {}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rpm,foo", "foo' is not a unit of a displayed quantity"),
        ("rpm,,deg", " is not a unit"),
        ("rpm,rev/s", "rpm and rev/s both show an angular speed"),
        ("K", "K' is not a unit"),
        ("x" * 1000, "is not a unit"),
    ],
)
def test_other_units_are_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=r"^units ") as refused:
        shown_units(text)
    assert said in str(refused.value)


@pytest.fixture(scope="module")
def swept() -> Sweep:
    scene = ab_sim.load_scene("thesis-hold", SHORT)
    return ab_sim.sweep(scene, {"balls.mass": "1 g..2 g:3"}, ["final_speed", "peak_whirl_over_e"])


def test_a_sweep_is_shown_in_other_units_and_stays_the_same(swept: Sweep) -> None:
    shown = swept.in_units("rpm, g")
    assert shown.titled("balls.mass") == "balls.mass [g]"
    assert shown.titled("peak_whirl_over_e") == swept.titled("peak_whirl_over_e")
    assert shown.shown("balls.mass").tolist() == [1.0, 1.5, 2.0]
    assert shown.shown("final_speed") == pytest.approx(swept["final_speed"] * 30 / np.pi)
    assert shown.report() == swept.report()
    assert shown.setting("balls.mass", 0.0015) == "balls.mass=1.5 g"
    first, *_ = [axes for axes in drawn(shown).axes if "final_speed" in axes.get_ylabel()]
    assert first.get_ylabel() == "final_speed [rpm]"
    assert first.lines[0].get_xdata().tolist() == [1.0, 1.5, 2.0]


def drawn(shown: Sweep) -> Figure:
    return shown.plot()


def test_a_spread_and_a_tuning_are_shown_so_too() -> None:
    scene = ab_sim.load_scene("thesis-hold", SHORT)
    spread = ab_sim.robust(scene, {"balls.mass": "5%"}, runs=16, metrics=["final_speed"], sobol=0)
    axes = spread.in_units("rpm").plot().axes[0]
    assert axes.get_xlabel() == "final_speed [rpm]"
    low, high = axes.get_xlim()
    assert low < spread["final_speed"][0] * 30 / np.pi < high
    tuned = ab_sim.tune(scene, {"balls.mass": "1 g..2 g"}, minimise="peak_whirl_over_e", runs=16)
    axes = tuned.in_units("g").plot().axes[0]
    assert axes.get_xlabel() == "m, mass of a ball\nballs.mass [g]"
    assert max(tuned.candidates[:, 0]) * 1e3 == max(
        x for line in axes.lines for x in np.atleast_1d(line.get_xdata()) if x <= 2.0
    )

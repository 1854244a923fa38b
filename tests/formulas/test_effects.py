"""Formulas of effects in print, and computed: by floats, by arrays, and through the trace."""

import re
import subprocess
import sys
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

from ab_sim.export.formulas.effects import METHODS, formulas_of, traced_method
from ab_sim.export.formulas.lines import Symbols, symbol_of_field
from ab_sim.model.equations import effects
from ab_sim.model.equations.motion import BallConstants, DeckMotion, on_race, relative_load
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import effect_classes, effect_parameters
from ab_sim.tracing import Graph, lowered
from ab_sim.tracing.expression import reachable_nodes
from ab_sim.tracing.lowering import name_of, unrolled
from tests.tracing.plain import python_function

EFFECTS = effect_classes()


def lines(name: str, method: str, kind: str = "text") -> list[str]:
    """A formula's lines."""
    found = {formula.method: formula for formula in formulas_of(EFFECTS[name])}[method]
    return [getattr(line, kind) for part in found.lines for line in part]


def test_suspension() -> None:
    assert lines("suspension", "deck_force") == ["f_1 = -c v_1 - k u_1", "f_2 = -c v_2 - k u_2"]
    assert lines("suspension", "deck_force", "latex") == [
        r"f_{1} = -c \, v_{1} - k \, u_{1}",
        r"f_{2} = -c \, v_{2} - k \, u_{2}",
    ]
    assert lines("suspension", "deck_energy") == ["E = 1/2 k (u_1^2 + u_2^2)"]
    assert lines("suspension", "deck_loss") == ["P = c (v_1^2 + v_2^2)"]


def test_hardening_suspension() -> None:
    first = lines("hardening_suspension", "deck_force", "latex")[0]
    assert first == r"f_{1} = -k_{3} \, \left(u_{1}^{2} + u_{2}^{2}\right) \, u_{1}"
    assert lines("hardening_suspension", "mount_energy") == ["E = 1/4 k_3 |u|^4"]


def test_unequal_suspension_keeps_what_its_source_names() -> None:
    assert lines("unequal_suspension", "space_force") == [
        "f_x = c f_p - s f_q",
        "f_y = s f_p + c f_q",
        "c = cos(axis_angle)",
        "s = sin(axis_angle)",
        "f_p = -k_1 (c u_x + s u_y) - c_1 (c v_x + s v_y)",
        "f_q = -k_2 (c u_y - s u_x) - c_2 (c v_y - s v_x)",
    ]


def test_motor() -> None:
    assert lines("motor", "loop_torque") == ["T_a = k_p (w_c - w) + k_i z"]
    assert lines("motor", "integral_rate", "latex") == [
        r"\dot{z} = \omega_{c} - \omega - "
        r"\frac{T_{a} - \mathrm{clip}\left(T_{a}\right)}{k_{p}}"
    ]
    assert lines("motor", "largest_torque") == ["T_max"]


def test_balls() -> None:
    assert lines("viscous_drag", "ball_drag") == ["F = -c_b s'"]
    assert lines("rolling_friction", "friction_coefficient") == ["nu = beta_b/a"]
    assert lines("race_friction", "friction_coefficient", "latex") == [r"\nu = \mu"]
    assert lines("ball_spin", "ball_inertia") == ["I/a^2 = 2/5 m"]
    assert lines("race_runout", "race_shape")[:3] == [
        "h - R = lobe wide + offset_1 c + offset_2 s",
        "x = -2 lobe skew - offset_1 s + offset_2 c",
        "l - R = -3 lobe wide",
    ]


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_printed(name: str) -> None:
    own = {key for key in vars(EFFECTS[name]) if key in METHODS}
    formulas = formulas_of(EFFECTS[name])
    assert {formula.method for formula in formulas} == own
    for formula in formulas:
        assert formula.meaning and not formula.trouble
        for line in [*formula.lines.equations, *formula.lines.quantities]:
            assert len(line.text) <= 88
            assert line.latex.count("{") == line.latex.count("}")
            assert line.latex.count(r"\left") == line.latex.count(r"\right")


def test_every_method_that_an_effect_may_have_is_known() -> None:
    documented = set(re.findall(r"(\w+)\(self", effects.__doc__ or "")) - {"check_scene"}
    assert documented == set(METHODS), "METHODS of formulas/methods.py, and the list differ"


@pytest.mark.parametrize(
    ("description", "symbol"),
    [
        ("k_3", "k_3"),
        ("beta_b, arm of rolling friction; beta_b/a is the coefficient", "beta_b"),
        ("T_max, at standstill", "T_max"),
        ("g, acceleration of free fall", "g"),
        ("I_r of rotor and disc", "I_r"),
        ("mu", "mu"),
        ("a slower approach does not bounce", "name"),
        ("offset of the race's centre towards the unbalance", "name"),
        ("angle between shaft and vertical", "name"),
    ],
)
def test_a_description_may_begin_with_a_symbol(description: str, symbol: str) -> None:
    assert symbol_of_field("name", description) == symbol


class Stranger(NamedTuple):
    """Not registered, with a method that nobody knows."""

    strength: Annotated[Number, quantity("m, like a ball's mass", "N")]
    count: int = 3

    def ball_drag(self, ball: Any) -> Any:
        return self.strength * ball.mass

    def breeze(self, deck: DeckMotion, gust: float) -> tuple[float, float]:
        return gust * self.count, self.strength * deck.vx

    def branch(self, gust: float) -> float:
        return gust if gust > 0 else 0.0


def test_an_effect_with_other_methods_is_printed_by_its_names() -> None:
    found = {formula.method: formula for formula in formulas_of(Stranger)}
    assert [line.text for line in found["breeze"].lines.equations] == [
        "breeze_1 = 3 gust",
        "breeze_2 = m vx",
    ]
    # A symbol that means something else here already: the field's name.
    assert [line.text for line in found["ball_drag"].lines.equations] == ["F = -strength m s'"]
    assert "where(...)" in found["branch"].trouble and not found["branch"].lines.equations


@pytest.mark.parametrize("name", EFFECTS)
def test_floats_compute_what_the_trace_does(name: str) -> None:
    generator = np.random.default_rng(7)
    effect = EFFECTS[name]
    for formula in formulas_of(effect):
        equations, _, fields = traced_method(effect, formula.method)
        roots = lowered(equation.right for equation in equations)
        symbols = {node.payload for node in reachable_nodes(roots) if node.op == "input"}
        given = {symbol: float(generator.uniform(0.1, 2.0)) for symbol in sorted(symbols)}
        arguments = {symbol: f"v{k}" for k, symbol in enumerate(given)}
        traced = python_function(roots, arguments)(**{arguments[s]: given[s] for s in given})

        numbers = Numbers(given)
        method = METHODS[formula.method]
        values = [numbers(fields[field]) for field in effect_parameters(effect)]
        result = getattr(effect(*values), formula.method)(*method.arguments(numbers))
        result = method.used(result, numbers)
        assert traced == pytest.approx(list(np.atleast_1d(result)), rel=1e-13), formula.method


class Numbers(Symbols):
    """Values in place of inputs."""

    def __init__(self, given: dict[str, float]) -> None:
        super().__init__(Graph())
        self._given = given

    def __call__(self, symbol: str) -> Any:
        """A number."""
        return self._given.get(symbol, 1.0)


def test_arrays_of_balls_compute_what_the_trace_does() -> None:
    n, runout = 5, effects.RaceRunout(1e-3, -2e-3, 5e-4, 0.3)
    generator = np.random.default_rng(3)
    each = {name: generator.uniform(0.1, 1.0, n) for name in ("m", "R", "lever", "theta", "rate")}

    def formula(x: Any, cos: Any, sin: Any, w: Any) -> list[Any]:
        balls = BallConstants(
            n, x["m"], 1.0, 1.0, 1.0, x["m"] * x["R"], x["lever"], x["R"], 1.0, 0.0
        )
        on = on_race((runout,), balls, cos(x["theta"]), sin(x["theta"]), x["rate"])
        return [*relative_load((runout,), balls, on, w), on.lever, on.path, on.dl_dtheta]

    by_arrays = formula(each, np.cos, np.sin, 150.0)
    graph = Graph()
    inputs = {name: graph.input(name, per_ball=True) for name in each}
    traced = formula(inputs, lambda a: a.cos(), lambda a: a.sin(), 150.0)
    roots = unrolled(lowered(traced), n)
    names = {name_of(name, k): f"{name}{k}" for name in each for k in range(n)}
    given = {f"{name}{k}": float(each[name][k]) for name in each for k in range(n)}
    flat = python_function([root for line in roots for root in line], names)(**given)
    assert np.reshape(flat, (5, n)) == pytest.approx(np.array(by_arrays), rel=1e-12)


def test_formulas_know_nothing_of_compilers() -> None:
    code = (
        "import pkgutil, importlib, sys, ab_sim.model.equations as e\n"
        "for module in pkgutil.walk_packages(e.__path__, 'ab_sim.model.equations.'):\n"
        "    importlib.import_module(module.name)\n"
        "import ab_sim.export.formulas.page\n"
        "print([name for name in sys.modules if name.split('.')[0] in ('numba', 'llvmlite')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"

"""docs/equations.md says what the code computes."""

from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ab_sim.export.formulas.planar as planar_page
from ab_sim.export.formulas.page import MAKE, PAGE, page_from_code
from ab_sim.export.formulas.planar import TracedEffect
from ab_sim.model.equations.arrowhead import normal_force
from ab_sim.model.equations.effects import BallSpin, Motor, RaceRunout, Suspension, ViscousDrag
from ab_sim.model.equations.motion import Ball, BallConstants, SpindleMotion, on_race
from ab_sim.model.equations.planar import Planar

ROOT = Path(__file__).parents[2]


def test_the_page_is_as_the_code_prints_it() -> None:
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    assert page_from_code(page) == page, f"run {MAKE}"


def test_the_planar_equations_in_print_have_all_that_effects_add(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the equations ask of effects, the effect that stands in for all of them has."""
    asked = set()

    class Asked(TracedEffect):
        def __getattr__(self, name: str) -> Any:
            asked.add(name)
            raise AttributeError(name)

    monkeypatch.setattr(planar_page, "TracedEffect", Asked)
    planar_page.planar_sections()
    # Its force is deck_force, on axes that turn.
    missing = asked - {"space_force"}
    assert not missing, "add them to TracedEffect in ab_sim/export/formulas/planar.py"


def test_a_page_without_places_is_refused() -> None:
    with pytest.raises(ValueError, match=r"docs/equations\.md: needs one place"):
        page_from_code("# nothing")


def test_the_page_names_files_that_are_there() -> None:
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    links = [part.split(")")[0] for part in page.split("](../")[1:]]
    assert len(links) > 8
    assert all((ROOT / link).exists() for link in links)


def dot(a: Any, b: Any) -> Any:
    """Of vectors per ball, shape (2, n), or of one for all."""
    return a[0] * b[0] + a[1] * b[1]


def test_vectors_of_section_1_are_what_the_code_computes() -> None:
    n, rng = 4, np.random.default_rng(5)
    m, a, R = rng.uniform(1e-3, 2e-3, n), np.full(n, 3e-3), np.full(n, 0.03)
    theta, rate, g = rng.uniform(-3, 3, n), rng.uniform(-50, 50, n), rng.uniform(-9, 9, n)
    w, T, M, M0, e, f = 120.0, 0.02, 0.12, 0.1, 1e-4, rng.uniform(-0.1, 0.1, n)
    effects = (
        Suspension(1000.0, 0.5),
        ViscousDrag(0.3),
        BallSpin(),
        RaceRunout(1e-3, -5e-4, 4e-4, 0.2),
        Motor(2e-5, 1.0, 1.0),
    )
    I_a2 = BallSpin().ball_inertia(Ball(m, a))  # type: ignore[arg-type]
    balls = BallConstants(n, m, a, m + I_a2, 1 / (m + I_a2), m * R, m * R - I_a2 * a, R, 1 / R, 0.0)
    on = on_race(effects, balls, np.cos(theta), np.sin(theta), rate)
    state, spindle = [1e-4, -2e-4, 0.03, 0.05], SpindleMotion(w, 0.0, cos(0.4), sin(0.4), T, 0.0)
    planar = Planar(M, M0 * e, e, 0.0, 0.0)
    arrow = planar.arrow(effects, balls, on, spindle, state)
    x = np.array([*rng.uniform(-9, 9, 2), 30.0])
    A, al = x[:2], x[2]

    # As the page has it.
    normal, along = np.array([on.c, on.s]), np.array([-on.s, on.c])
    h, q, curve, path = on.h, on.x, on.curve, on.path
    outwards = h * w**2 + 2 * w * path + curve * rate**2 + q * al
    forwards = q * w**2 - h * al - g
    force = -0.5 * np.array(state[2:]) - 1000.0 * np.array(state[:2])
    deck = force + M0 * e * np.array([w**2, -al])
    deck = deck + np.sum(m * (outwards * normal + forwards * along), axis=1)
    own = A[:, None] - outwards * normal - forwards * along
    at = h * normal + q * along
    moment = m * (at[0] * own[1] - at[1] * own[0]) + I_a2 * a * (a * al - g)
    spin_up = (2e-5 + M0 * e**2) * al + M0 * e * A[1] + np.sum(moment)
    N = m * (outwards - dot(A, normal))
    ball = -0.3 * path - f * N - m * dot(A, along) - (h * m - I_a2 * a) * al + m * q * w**2

    # As the code does: block x - sum_i reach_i g_i = force.
    block = np.array([[arrow.block[min(r, k)][max(r, k)] for k in range(3)] for r in range(3)])
    reach = np.array([np.broadcast_to(each, n) for each in arrow.coupling])
    left = block @ x - reach @ g - np.array(arrow.force)
    assert left[:2] == pytest.approx(M * A - deck, rel=1e-10)
    assert left[2] == pytest.approx(spin_up - T, rel=1e-10)
    assert normal_force(arrow, x) == pytest.approx(N, rel=1e-10)  # type: ignore[arg-type]
    pull = arrow.path_force + x @ reach - f * normal_force(arrow, x)  # type: ignore[arg-type]
    assert pull == pytest.approx(ball, rel=1e-10)

    v = np.array(state[2:])
    J = np.array([[0.0, -1.0], [1.0, 0.0]])
    rates = [*(v - w * J @ state[:2]), *(A - w * J @ v)]
    assert planar.rates(effects, spindle, state, list(x)) == pytest.approx(rates, rel=1e-12)

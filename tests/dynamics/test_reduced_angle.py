"""Angles beyond a turn: how many turns, and what is left, against rational arithmetic."""

import math
import random
from fractions import Fraction

import pytest

from ab_sim.model.equations.neighbours import reduced

PI = Fraction(
    "3.14159265358979323846264338327950288419716939937510582097494459230781640628620899863"
)


@pytest.mark.parametrize("most", [4.0, 10.0, 1e3, 1e10, 1e15])
def test_turns_are_exact_and_the_rest_is_nearly(most: float) -> None:
    draw = random.Random(1)
    for _ in range(3000):
        angle = draw.uniform(-most, most)
        within, turns = reduced(angle)
        assert abs(within) <= math.pi and turns == int(turns)
        assert abs(Fraction(within) + 2 * PI * Fraction(turns) - Fraction(angle)) < 5e-16


def test_an_angle_within_a_turn_stays_as_it_is() -> None:
    draw = random.Random(2)
    for angle in [-math.pi, -0.0, math.pi, *(draw.uniform(-3.0, 3.0) for _ in range(3000))]:
        assert reduced(angle) == (angle, 0.0)

"""What a balancer is sized for: units, grades, errors."""

from typing import Any

import pytest

from ab_sim.base.errors import InputError
from tests.design.sizing.wanted import wanted


def test_units_and_numbers_in_si_are_the_same() -> None:
    plain = wanted(
        mass=0.1, unbalance=3e-6, critical_speed=100.0, speed=200, race_radius=0.012,
        race_width=0.004, settle=3.0, density=7850.0, acceleration=200.0,
    )  # fmt: skip
    assert wanted() == plain
    assert wanted(density="7.85 g/cm^3").density == pytest.approx(7850.0)
    assert wanted(speed="3000 rpm").speed == pytest.approx(314.159265)


@pytest.mark.parametrize("given", ["0.1 g cm..0.3 g cm", "0.1..0.3 g cm", (1e-6, 3e-6)])
def test_a_range_of_unbalance(given: Any) -> None:
    found = wanted(unbalance=given)
    assert (found.least_unbalance, found.largest_unbalance) == pytest.approx((1e-6, 3e-6))


@pytest.mark.parametrize("given", ["G6.3", "g 6.3", 6.3, "6.3 mm/s"])
def test_a_grade_is_the_speed_of_the_mass_centre(given: Any) -> None:
    """G = e w, and U = M e: 6.3 mm/s at 200 rad/s are 31.5 um."""
    found = wanted(unbalance=None, grade=given)
    assert found.largest_unbalance == pytest.approx(3.15e-6) and found.least_unbalance == 0.0


def test_stiffness_and_damping() -> None:
    found = wanted(damping_ratio=0.02)
    assert found.stiffness == pytest.approx(1000.0) and found.damping == pytest.approx(0.4)
    assert found.limit == pytest.approx(3e-7) and list(found.counts) == [2, 3, 4, 5, 6]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"speed": "90 rad/s"}, "speed = 90 rad/s: must be above"),
        ({"mass": "1 mm"}, "mass = '1 mm': is a length"),
        ({"mass": "heavy"}, "mass = 'heavy': "),
        ({"mass": -1}, "mass = -1: must be from 1e-9"),
        ({"mass": "nan"}, "must be a finite number"),
        ({"unbalance": None}, "unbalance, grade: "),
        ({"grade": "G1"}, "unbalance, grade: "),
        ({"unbalance": None, "grade": "fine"}, "grade = 'fine': must be like G6.3"),
        ({"unbalance": None, "grade": 0.0}, "grade = 0: must be above 0"),
        ({"unbalance": "0.3..0.1 g cm"}, "above 0, and rise"),
        ({"unbalance": (1e-7, 2e-7, 3e-7)}, "LEAST..LARGEST"),
        ({"unbalance": "3 kg m"}, "check its unit"),
        ({"race_width": "20 mm"}, "must be at most race-radius"),
        ({"density": "wood"}, "steel, ceramic, tungsten carbide"),
        ({"balls": "1..3"}, "a single ball balances only one unbalance"),
        ({"balls": "a"}, "must be FROM..TO"),
        ({"balls": "6..3"}, "must be FROM..TO"),
        ({"damping_ratio": 0.0}, "damping-ratio = 0: must be from 0.0001 to 1"),
        ({"share": 1.5}, "share = 1.5: must be from"),
        ({"residual": 0.0}, "residual = 0: must be from"),
        ({"drag_tolerance": 1.0}, "drag-tolerance = 1: must be from"),
    ],
)
def test_what_cannot_be_is_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as raised:
        wanted(**changes)
    assert words in str(raised.value), str(raised.value)

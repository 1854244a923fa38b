"""Numbers with their unit: what they are in SI, and what is refused."""

import math
import re
import subprocess
import sys
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from typing import Any, NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ab_sim.scene.keys import scene_keys
from ab_sim.scene.schema import WITH_UNIT
from ab_sim.scene.units import KINDS, MOST, NO_UNIT, has_unit, in_si

LINEAR = {
    "kg": {
        "kg": 1,
        "g": Fraction(1, 1000),
        "mg": Fraction(1, 10**6),
        "lb": Fraction(45359237, 10**8),
    },
    "m": {"m": 1, "mm": Fraction(1, 1000), "um": Fraction(1, 10**6), "inch": Fraction(254, 10**4)},
    "s": {"s": 1, "ms": Fraction(1, 1000), "min": 60, "us": Fraction(1, 10**6)},
    "N/m": {"N/mm": 1000, "kN/m": 1000, "kg/s^2": 1, "mN/mm": 1},
    "kg m": {"g mm": Fraction(1, 10**6), "g*cm": Fraction(1, 10**5), "g·m": Fraction(1, 1000)},
    "kg m^2": {"g cm^2": Fraction(1, 10**7), "g cm²": Fraction(1, 10**7), "kg*m**2": 1},
    "N m s/rad": {"mN m s/rad": Fraction(1, 1000), "mN m/(rad/s)": Fraction(1, 1000)},
    "m/s^2": {"mm/s^2": Fraction(1, 1000), "g_0": Fraction(980665, 10**5), "m s^-2": 1},
    "Hz": {"kHz": 1000, "s^-1": 1},
}
"""What each unit is in a key's, exactly."""
PAIRS = [(key, unit, factor) for key, by in LINEAR.items() for unit, factor in by.items()]
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494")
ANGULAR = {
    ("rad", "deg"): 2 * PI / 360,
    ("rad", "rev"): 2 * PI,
    ("rad/s", "rpm"): 2 * PI / 60,
    ("rad/s", "rev/s"): 2 * PI,
    ("rad/s", "turn/min"): 2 * PI / 60,
    ("rad/s^2", "rpm/s"): 2 * PI / 60,
}
NUMBERS = st.decimals(-(10**6), 10**6, places=6).map(str)


@pytest.mark.parametrize(("key", "unit", "factor"), PAIRS)
@given(number=NUMBERS)
@settings(max_examples=20)
def test_it_is_the_float_nearest_to_what_is_written(
    key: str, unit: str, factor: Fraction | int, number: str
) -> None:
    assert in_si(f"{number} {unit}", key) == float(Fraction(number) * factor)


@pytest.mark.parametrize("pair", ANGULAR, ids="-".join)
@given(number=NUMBERS)
@settings(max_examples=20)
def test_angles_are_as_good(pair: tuple[str, str], number: str) -> None:
    key, unit = pair
    with localcontext(Context(prec=60)):
        exact = Decimal(number) * (ANGULAR[pair])
    assert in_si(f"{number} {unit}", key) == pytest.approx(float(exact), rel=1e-15, abs=0)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_in_the_keys_own_unit_it_is_the_number_to_the_bit(number: float) -> None:
    for unit in KINDS:
        assert in_si(f"{number!r} {unit}", unit) == number


def test_numbers_are_round_where_floats_would_not_be() -> None:
    assert in_si("12 mm", "m") == 0.012
    assert in_si("1 g", "kg") == 0.001
    assert in_si("0.3 g cm", "kg m") == 3e-6
    assert in_si("180 deg", "rad") == math.pi
    assert in_si("60 rpm", "rad/s") == in_si("1 rev/s", "rad/s") == 2 * math.pi
    assert in_si("70 ug_0/sqrt(Hz)", "(m/s^2)/sqrt(Hz)") == 70 * 9.80665e-6


def test_the_decimals_of_whoever_calls_do_not_matter() -> None:
    """Whose context also holds while units are defined, at their first use in a process."""
    program = """
import decimal, math
from ab_sim.scene.units import in_si
decimal.getcontext().prec = 3
assert in_si("1.23456789 inch", "m") == 0.031358024406
assert in_si("45 deg", "rad") == math.pi / 4
"""
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize("row", scene_keys(), ids=lambda row: row.key)
def test_every_unit_of_a_key_is_known_with_an_example(row: Any) -> None:
    if row.unit not in NO_UNIT:
        assert row.unit in KINDS, "errors say what it measures, and give an example"
        assert math.isfinite(in_si(KINDS[row.unit].example, row.unit))


class Refused(NamedTuple):
    """A text, the unit of its key, and what is said."""

    text: str
    unit: str
    said: str


REFUSED = [
    Refused("12 mm", "kg", "is a length [m], must be a mass [kg], e.g. 1 g"),
    Refused("42 Hz", "rad/s", "is a frequency [Hz], must be an angular speed [rad/s], e.g. 2500 "),
    Refused("42 Hz", "rad/s", "write rev/s, rpm or rad/s"),
    Refused("60 rpm", "Hz", "60 rpm are one turn a second: write 1 Hz"),
    Refused("16 g", "m/s^2", "is a mass [kg], must be an acceleration [m/s^2], e.g. 16 g_0; g is"),
    Refused("5 N m", "N m/rad", "write N m/rad"),
    Refused("3 percent", "rad", "has no dimension, must be an angle [rad], e.g. 45 deg"),
    Refused("20 degC", "m", "is in [K], must be a length [m]"),
    Refused("3 dB", "m", "has no dimension"),
    Refused("45 deg", "1", "must be a number without unit"),
    Refused("50 percent", "1", "must be a number without unit"),
    Refused("12 mmm", "m", "'mmm' is not a known unit; must be a length [m], e.g. 12 mm"),
    Refused("12 nan", "m", "'nan' is not a known unit"),
    Refused("12 MM", "m", "is in [mol/m^3], must be a length"),
    Refused("1 min", "m", "is a time [s], must be a length"),
    Refused("1 m in", "m", "is in [m^2], must be a length"),
    Refused("9**9**9 m", "m", "is not a known unit"),
    Refused("1 m^9^9^9", "m", "is not a known unit"),
    Refused("1 (m^9)^9", "m", "is not a known unit"),
    Refused("1 m^999", "m", "is not a known unit"),
    Refused("1 m.__class__", "m", "is not a known unit"),
    Refused("1 m; 2", "m", "is not a known unit"),
    Refused("__import__('os')", "m", "must be a number, in m or with a unit, e.g. 12 mm"),
    Refused("1 __import__('os')", "m", "is not a known unit"),
    Refused("nan m", "m", "must be a number"),
    Refused("inf m", "m", "must be a number"),
    Refused("1,5 mm", "m", "is not a known unit"),
    Refused("0x10 m", "m", "'x10 m' is not a known unit"),
    Refused("mm", "m", "must be a number"),
    Refused("", "m", "must be a number"),
    Refused("1e400 m", "m", "is too large for a float"),
    Refused("1e308 km", "m", "is too large for a float"),
    Refused("1e999999999 m", "m", "is not a known unit"),
    Refused("1" * MOST + " m", "m", "must be a number"),
    Refused("3 dBm", "W", "cannot be computed from that unit; must be in [W], e.g. 0.5 W"),
    Refused("1 m", "wobble", "must be a number in wobble, written without unit"),
]


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: f"{case.text[:20]}-{case.unit}")
def test_what_does_not_fit_is_refused(case: Refused) -> None:
    with pytest.raises(ValueError) as caught:
        in_si(case.text, case.unit)
    assert case.said in str(caught.value)


WORDS = st.sampled_from(
    [*"()*/^ .,+-e_²µ°\n", "**", "sqrt(", "m", "rad", "degC", "dBm", "g_0", "pi", "9", "1e5", "per"]
)


@given(st.lists(WORDS, max_size=20).map("".join), st.sampled_from(sorted(KINDS)))
@settings(max_examples=500)
def test_any_text_is_a_number_or_refused(text: str, unit: str) -> None:
    try:
        assert math.isfinite(in_si(f"1 {text}", unit))
    except ValueError as error:
        assert "must be" in str(error)


@pytest.mark.parametrize(
    "text", ["12", "1e3", "1E5", "-.5", "1_000", "inf", "nan", "mm", "", "a b"]
)
def test_a_plain_number_or_text_is_not_looked_at(text: str) -> None:
    assert not has_unit(text)


@pytest.mark.parametrize("text", ["12 mm", "12mm", " 1e3 m ", "-.5 (m)", "3 °"])
def test_a_number_with_something_behind_it_is(text: str) -> None:
    assert has_unit(text)
    assert re.search(WITH_UNIT, text)

"""Specification of a balancer: drive, unbalance and space for a race."""

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from ab_sim.base.errors import InputError, exact, short
from ab_sim.base.numbers import number_in, whole_number_in
from ab_sim.scene.units import has_unit, in_si, with_last_unit

Given = str | float
"""Number in SI units, or text with its unit."""
_DENSITIES = {"steel": 7850.0, "ceramic": 3250.0, "tungsten carbide": 14900.0}
"""Densities of balls [kg/m^3]: bearing steel, silicon nitride, tungsten carbide with cobalt."""
BALLS = (2, 6)
"""Default range of the number of balls."""
MOST_BALLS = 12
"""Largest number of balls of a sizing."""
DAMPING_RATIO, SETTLE, DENSITY, SHARE, RESIDUAL, DRAG_TOLERANCE = 0.05, 3.0, "steel", 0.9, 0.1, 0.2
"""Defaults of ``SpecificationTexts``: ``SETTLE`` in s, ``DENSITY`` as a name, others as ratios."""
RUN_UP = 1.0
"""Default time to reach the running speed [s]."""
_GRADE = re.compile(r"\s*[Gg]\s*([0-9]+\.?[0-9]*|\.[0-9]+)\s*")


class DriveSpecification(NamedTuple):
    """Requirements of a sizing in SI units, created by ``specification_of``."""

    mass: float
    """Suspended mass M0 without balls [kg]."""
    least_unbalance: float
    largest_unbalance: float
    """Range of the unbalance U = M0 e [kg m], from ``least_unbalance``; uniformly distributed."""
    critical_speed: float
    """Critical speed sqrt(k/M0) without balls [rad/s]."""
    speed: float
    """Running speed [rad/s]."""
    race_radius: float
    """Inner radius of the wall on which balls roll [m]."""
    race_width: float
    """Space for a ball's diameter [m]."""
    damping_ratio: float
    """Damping ratio c / (2 sqrt(k M0))."""
    acceleration: float
    """Acceleration of the run-up [rad/s^2]."""
    settle: float
    """Time from the running speed until a drive must be balanced [s]."""
    density: float
    """Density of the balls [kg/m^3]."""
    fewest: int
    most: int
    """Range of the number of balls, from ``fewest``."""
    share: float
    """Share of drives that must be balanced within ``settle``, above 0, below 1."""
    residual: float
    """Allowed residual unbalance, relative to the largest unbalance."""
    drag_tolerance: float
    """Relative tolerance of the drag, uniformly distributed to either side."""
    friction_arm: float = 0.0
    """Arm of rolling friction [m]; predictions ignore it, runs include it."""

    @property
    def limit(self) -> float:
        """Allowed residual unbalance [kg m]."""
        return self.residual * self.largest_unbalance

    @property
    def stiffness(self) -> float:
        """Stiffness k [N/m]."""
        return self.mass * self.critical_speed**2

    @property
    def damping(self) -> float:
        """Damping c [N s/m]."""
        return 2.0 * self.damping_ratio * self.mass * self.critical_speed

    @property
    def counts(self) -> range:
        """Numbers of balls."""
        return range(self.fewest, self.most + 1)


class SpecificationTexts(NamedTuple):
    """Specification as written by a user: numbers in SI units, or texts with a unit."""

    mass: Given
    """Suspended mass M0 without balls [kg]."""
    critical_speed: Given
    """Critical speed without balls [rad/s]."""
    speed: Given
    """Running speed [rad/s]."""
    race_radius: Given
    """Inner radius of the wall on which balls roll [m]."""
    race_width: Given
    """Space for a ball's diameter [m]."""
    unbalance: Given | Sequence[float] | None = None
    """Largest unbalance, or range: ``0.1 g cm..0.3 g cm``."""
    grade: Given | None = None
    """Balance grade of the rotor instead of the unbalance: ``G6.3``, or 6.3 [mm/s]."""
    damping_ratio: float = DAMPING_RATIO
    """Damping ratio of the suspension."""
    acceleration: Given | None = None
    """Acceleration of the run-up [rad/s^2]; None to reach the speed in ``RUN_UP``."""
    settle: Given = SETTLE
    """Time from the running speed until a drive must be balanced [s]."""
    density: Given = DENSITY
    """Density of the balls [kg/m^3], or a name in ``_DENSITIES``."""
    balls: str | Sequence[int] = BALLS
    """Range of the number of balls, ``2..6``, or a single number."""
    share: float = SHARE
    """Share of drives that must be balanced in time."""
    residual: float = RESIDUAL
    """Allowed residual unbalance, relative to the largest unbalance."""
    drag_tolerance: float = DRAG_TOLERANCE
    """Relative tolerance of the drag."""
    friction_arm: Given = 0.0
    """Arm of rolling friction [m]."""


def specification_of(texts: SpecificationTexts) -> DriveSpecification:
    """Return a checked specification.

    Raises
    ------
    InputError
        A number is not allowed, or both or none of unbalance and grade are given; the message
        states the allowed values and the remedy.
    """
    mass = _positive("mass", texts.mass, "kg")
    critical = _positive("critical", texts.critical_speed, "rad/s")
    speed = _positive("speed", texts.speed, "rad/s")
    if speed <= critical:
        raise InputError(
            f"speed = {exact(speed)} rad/s: must be above critical = {exact(critical)} rad/s; "
            "below it balls make the unbalance worse: run faster, or mount the drive softer"
        )
    radius = _positive("race-radius", texts.race_radius, "m")
    width = _positive("race-width", texts.race_width, "m")
    if width > radius:
        raise InputError(
            f"race-width = {exact(width)} m: is the largest diameter of a ball; must be at most "
            f"race-radius = {exact(radius)} m"
        )
    least, largest = _unbalance(texts, mass, speed)
    if largest > mass * radius:
        raise InputError(
            f"unbalance = {exact(largest)} kg m: must be at most mass times race-radius = "
            f"{exact(mass * radius)} kg m; check its unit"
        )
    fewest, most = _counts(texts.balls)
    acceleration = speed / RUN_UP if texts.acceleration is None else texts.acceleration
    return DriveSpecification(
        mass, least, largest, critical, speed, radius, width,
        _between("damping-ratio", texts.damping_ratio, 1e-4, 1.0),
        _positive("acceleration", acceleration, "rad/s^2"),
        _positive("settle", texts.settle, "s"),
        _density(texts.density),
        fewest, most,
        _between("share", texts.share, 0.01, 0.999),
        _between("residual", texts.residual, 1e-3, 0.9),
        _between("drag-tolerance", texts.drag_tolerance, 0.0, 0.9),
        _between("friction-arm", _number("friction-arm", texts.friction_arm, "m"), 0.0, radius),
    )  # fmt: skip


def _unbalance(texts: SpecificationTexts, mass: float, speed: float) -> tuple[float, float]:
    """Return the least and the largest unbalance [kg m].

    Parameters
    ----------
    texts
        Specification with an unbalance or a balance grade.
    mass
        Suspended mass [kg].
    speed
        Running speed [rad/s].
    """
    if (texts.unbalance is None) == (texts.grade is None):
        raise InputError("unbalance, grade: give one of them, e.g. unbalance '0.3 g cm'")
    if texts.grade is not None:
        return 0.0, mass * _grade(texts.grade) / speed  # U = M G / w, ISO 21940-11
    parts: Sequence[Given]
    if isinstance(texts.unbalance, str):
        parts = _ends(texts.unbalance)
    elif isinstance(texts.unbalance, Sequence):
        parts = texts.unbalance
    else:
        assert texts.unbalance is not None
        parts = [texts.unbalance]
    if len(parts) not in (1, 2):
        raise InputError(
            f"unbalance = {short(texts.unbalance)}: must be one value, the largest unbalance, or a "
            "range LEAST..LARGEST, e.g. '0.1..0.3 g cm'"
        )
    numbers = [_number("unbalance", part, "kg m") for part in parts]
    least, largest = (0.0, numbers[0]) if len(numbers) == 1 else (numbers[0], numbers[1])
    if not 0.0 <= least < largest or largest < 1e-15:
        raise InputError(
            f"unbalance = {short(texts.unbalance)}: must be above 0, and rise from least to largest"
        )
    return least, largest


def _ends(text: str) -> list[str]:
    """Return the one or two numbers of an unbalance, each with its unit."""
    try:
        return with_last_unit(text.split(".."))
    except ValueError as error:
        raise InputError(f"unbalance = {short(text)}: the upper end {error}") from None


def _grade(quantity: Given) -> float:
    """Read a balance grade, ``G6.3`` or a number in mm/s; return it in m/s."""
    if isinstance(quantity, str):
        match = _GRADE.fullmatch(quantity)
        if match is None:
            if has_unit(quantity):
                return _positive("grade", quantity, "m/s")
            raise InputError(f"grade = {short(quantity)}: must be like G6.3, the number in mm/s")
        quantity = float(match[1])
    if not 0.0 < quantity <= 1e5:
        raise InputError(f"grade = {exact(quantity)}: must be above 0 mm/s, at most 1e5")
    return 1e-3 * quantity


def _density(quantity: Given) -> float:
    """Read a density or the name of a material; return it in kg/m^3."""
    if isinstance(quantity, str) and quantity.strip().lower() in _DENSITIES:
        return _DENSITIES[quantity.strip().lower()]
    try:
        return _between("density", _number("density", quantity, "kg/m^3"), 100.0, 25000.0)
    except InputError as error:
        names = ", ".join(_DENSITIES)
        raise InputError(f"{error}; or one of {names}") from None


def _counts(counts: str | Sequence[int]) -> tuple[int, int]:
    """Read a range of the number of balls; return its ends."""
    parts = counts.split("..") if isinstance(counts, str) else list(counts)
    try:
        numbers = [whole_number_in(str(part)) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2) or not 2 <= numbers[0] <= numbers[-1] <= MOST_BALLS:
        raise InputError(
            f"balls = {short(counts)}: must be FROM..TO or a number, from 2 to {MOST_BALLS}; a "
            "single ball balances only one unbalance, not a range"
        )
    return numbers[0], numbers[-1]


def _number(field: str, quantity: Given, unit: str) -> float:
    """Read a finite number with a unit or in SI; return it in the SI unit ``unit``."""
    try:
        if isinstance(quantity, str) and has_unit(quantity):
            return in_si(quantity, unit)
        number = number_in(quantity) if isinstance(quantity, str) else float(quantity)
    except ValueError as error:
        message = (
            error
            if isinstance(quantity, str) and has_unit(quantity)
            else f"must be a number in {unit}"
        )
        raise InputError(f"{field} = {short(quantity)}: {message}") from None
    if not math.isfinite(number):
        raise InputError(f"{field} = {short(quantity)}: must be a finite number")
    return number


def _positive(field: str, quantity: Given, unit: str) -> float:
    """Read a number from 1e-9 to 1e9, see ``_number``."""
    number = _number(field, quantity, unit)
    if not 1e-9 <= number <= 1e9:
        raise InputError(f"{field} = {short(quantity)}: must be from 1e-9 to 1e9 {unit}")
    return number


def _between(field: str, number: float, low: float, high: float) -> float:
    """Return a number after a check of its range; ``field`` is its name in the error."""
    if not low <= number <= high:
        raise InputError(f"{field} = {exact(number)}: must be from {low:g} to {high:g}")
    return float(number)

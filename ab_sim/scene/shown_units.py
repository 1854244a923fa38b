"""Units for SI values in tables and pictures; files stay in SI."""

from typing import NamedTuple

from ab_sim.base.errors import InputError
from ab_sim.base.quoting import short
from ab_sim.scene.units import KINDS, in_si, si_unit


class ShownUnit(NamedTuple):
    """A unit for display."""

    text: str
    factor: float
    """Factor from SI to this unit."""


ShownUnits = dict[str, ShownUnit]
"""Units for display by SI unit; other quantities are shown in SI."""
METRICS_OWN = {"mm/s": ("m/s", 1e-3)}
"""Units of metrics that are not SI: the SI unit and the factor from this unit to it."""


def shown_units(text: str) -> ShownUnits:
    """Parse units such as ``rpm,g mm,deg``.

    Args:
        text: units separated by commas, at most one of each kind; empty: all quantities are shown
            in SI.

    Raises:
        InputError: a text is not a unit of a quantity of scenes or metrics, two units measure the
            same quantity, or pint is not installed.
    """
    units_shown: ShownUnits = {}
    for written in map(str.strip, text.split(",") if text.strip() else []):
        try:
            unit = si_unit(written)
        except ImportError:
            raise InputError(f"units {short(text)}: need pint: pip install 'pint>=0.24'") from None
        if unit is None:
            raise InputError(
                f"units {short(text)}: {short(written)} is not a unit of a displayed quantity; "
                "give units separated by commas, e.g. rpm,g mm,deg, of "
                + ", ".join(
                    kind.name.removeprefix("a ").removeprefix("an ") for kind in KINDS.values()
                )
            )
        if unit in units_shown:
            raise InputError(
                f"units {short(text)}: {units_shown[unit].text} and {written} both show "
                f"{KINDS[unit].name}; give one of them"
            )
        units_shown[unit] = ShownUnit(written, 1.0 / in_si(f"1 {written}", unit))
    for unit_name, (unit, factor) in METRICS_OWN.items():
        if unit in units_shown:
            units_shown[unit_name] = units_shown[unit]._replace(
                factor=factor * units_shown[unit].factor
            )
    return units_shown

"""Units in which tables and pictures show what is in SI; files stay in SI."""

from typing import NamedTuple

from ab_sim.errors import InputError
from ab_sim.quoting import short
from ab_sim.scene.units import KINDS, in_si, si_unit


class ShownUnit(NamedTuple):
    """A unit to show numbers in."""

    text: str
    factor: float
    """Turns SI into it."""


ShownUnits = dict[str, ShownUnit]
"""By the unit that they stand for; what is not there is shown as it is."""
MERITS_OWN = {"mm/s": ("m/s", 1e-3)}
"""Units of merits that are not SI: the SI unit, and what turns them into it."""


def shown_units(text: str) -> ShownUnits:
    """Units out of ``rpm,g mm,deg``.

    Args:
        text: units with commas between, at most one of each kind; empty: all is shown in SI.

    Raises:
        InputError: one is no unit of what scenes and merits have, or two measure the same.
    """
    found: ShownUnits = {}
    for written in map(str.strip, text.split(",") if text.strip() else []):
        try:
            unit = si_unit(written)
        except ImportError:
            raise InputError(f"units {short(text)}: need pint: pip install 'pint>=0.24'") from None
        if unit is None:
            raise InputError(
                f"units {short(text)}: {short(written)} is no unit of a number that is shown; "
                "give units with commas between, e.g. rpm,g mm,deg, of "
                + ", ".join(
                    kind.name.removeprefix("a ").removeprefix("an ") for kind in KINDS.values()
                )
            )
        if unit in found:
            raise InputError(
                f"units {short(text)}: {found[unit].text} and {written} both show "
                f"{KINDS[unit].name}; give one of them"
            )
        found[unit] = ShownUnit(written, 1.0 / in_si(f"1 {written}", unit))
    for own, (unit, factor) in MERITS_OWN.items():
        if unit in found:
            found[own] = found[unit]._replace(factor=factor * found[unit].factor)
    return found

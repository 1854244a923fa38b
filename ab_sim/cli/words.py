"""What several commands read from the words of their options."""

from ab_sim.analysis.merits.merit import merits_named
from ab_sim.design.sweep import DEFAULT_MERITS
from ab_sim.errors import InputError
from ab_sim.quoting import short


def wanted_merits(text: str | None) -> tuple[str, ...]:
    """Keys of merits with commas between; None: those of a sweep.

    Raises:
        InputError: there is no such merit; names the nearest, and all.
    """
    if text is None:
        return DEFAULT_MERITS
    found = tuple(each.strip() for each in text.split(","))
    merits_named(found)
    return found


def share_of(option: str, text: str, must: str) -> float:
    """A share, as a number or in %.

    Args:
        option: without its dashes.
        text: as it is written.
        must: what it must be, for the error.

    Raises:
        InputError: it is no number.
    """
    plain = text.strip()
    try:
        return float(plain.removesuffix("%")) / (100.0 if plain.endswith("%") else 1.0)
    except ValueError:
        raise InputError(f"--{option} {short(text)}: {must}") from None

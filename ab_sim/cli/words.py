"""Parsing of options and texts that several commands share."""

from collections.abc import Iterator

from ab_sim.analysis.merits.merit import merits_named
from ab_sim.analysis.merits.verdict import Verdict
from ab_sim.design.sweep import DEFAULT_MERITS, Sweep
from ab_sim.errors import InputError
from ab_sim.quoting import short

_SHOWS = "a longer duration (--set duration=...) shows where it goes"
_NO_FINAL = f"the whirl has no final value yet, and the run does not count; {_SHOWS}"
_NOTES = {
    Verdict.RINGING_DOWN: f"the run counts, its final whirl as an upper bound; {_SHOWS}",
    Verdict.CHANGING: _NO_FINAL,
    Verdict.UNSETTLED: _NO_FINAL,
    Verdict.CIRCULATES: "balls go round the race, and the run does not count",
}


def outcome_notes(found: Sweep) -> Iterator[str]:
    """Yield the meanings of the outcomes that occur, and a note if balls never part."""
    for verdict, note in _NOTES.items():
        if verdict.value in found.outcomes:
            yield f"{verdict.value}: {note}"
    if found.together:
        yield found.together


def wanted_merits(text: str | None) -> tuple[str, ...]:
    """Parse names of metrics separated by commas; None: those of a sweep.

    Raises:
        InputError: there is no such metric; the message names the nearest and all.
    """
    if text is None:
        return DEFAULT_MERITS
    found = tuple(each.strip() for each in text.split(","))
    merits_named(found)
    return found


def share_of(option: str, text: str, must: str) -> float:
    """Parse a share, given as a number or in %.

    Args:
        option: name without its dashes.
        text: text of the option.
        must: allowed values, for the error.

    Raises:
        InputError: the text is not a number.
    """
    plain = text.strip()
    try:
        return float(plain.removesuffix("%")) / (100.0 if plain.endswith("%") else 1.0)
    except ValueError:
        raise InputError(f"--{option} {short(text)}: {must}") from None

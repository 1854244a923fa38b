"""The page's head: what holds, what does not, what to take from it; its numbers are the rows'."""

import re
from collections.abc import Sequence

from gallery.page import PageSection
from gallery.thesis.claims import FAILS, HOLDS, UNDECIDED
from gallery.thesis.five_balls import OTHERS_NAMED
from gallery.thesis.ratios import FARTHER as DONE

MATCHED, RULES, BARS = "Ours: balls that match", "Each rule over a range", "Whirl at 8000 rpm"
"""Tables, as their titles begin."""
ASKED = {
    "M": ("4.27", "m must be increased"),
    "k": ("4.30", "m must be reduced"),
    "m": ("4.40", "m = 2 g: difficult"),
    "c_b": ("4.44", "c_b = 2: difficult"),
}
"""By what is changed the row that asks for more than another end time."""
FARTHER = "ours: to -540"
OPTIMISED = {
    "M": ("4.28", "the end time of section 4.4"),
    "k": ("4.31", "the end time of section 4.4"),
}
"""By what is changed, m with it, the row of the best end time."""


def in_short(sections: Sequence[PageSection]) -> PageSection:
    """Of the sections that have rows."""
    return PageSection(
        "In five lines",
        (_count(sections), _balance(sections), _soonest(sections), _rules(sections),
         _five_balls(sections)),
    )  # fmt: skip


def counted(sections: Sequence[PageSection]) -> tuple[int, int]:
    """How many statements have a verdict, and how many hold."""
    verdicts = [row[-1] for row in _rows(sections)]
    hold = sum(verdict == HOLDS for verdict in verdicts)
    return hold + sum(verdict.startswith(FAILS) for verdict in verdicts), hold


def _count(sections: Sequence[PageSection]) -> str:
    each = [(section.heading.split()[0], *counted([section])) for section in sections]
    by_section = ", ".join(f"{hold} of {all_} in {name}" for name, all_, hold in each if all_)
    most, hold = counted(sections)
    return f"1. {hold} of {most} judged statements hold: {by_section}."


def _balance(sections: Sequence[PageSection]) -> str:
    gone = "residual unbalance is eliminated"
    left = [_ours(sections, f, gone).split()[0] for f in ("4.7, 4.8", "4.9, 4.10", "4.11, 4.12")]
    none, hold, light, light_held = [row[-1] for row in _table(sections, MATCHED)]
    return (
        f'2. "Residual unbalance is eliminated" does not hold: {", ".join(left)} of the disc\'s '
        f"unbalance remain with the hold (4.7, 4.9, 4.11). At 200 rad/s W/e is {hold} with it, "
        f"{none} without. Balls that match, 2 m R = M0 e, end at {light_held} with the hold, "
        f"{light} without."
    )


def _soonest(sections: Sequence[PageSection]) -> str:
    ours = _ours(sections, "section 4.4", "the aim: initial learning")
    times = re.findall(r"([\d.]+) s\b", ours)
    return (
        f"3. The period that brings the balls to -180 deg first is not the fastest start-up: W is "
        f"in its final band from {times[0]} and {times[1]} s, without a period from {times[2]} s, "
        "with the same final state. The best duration depends on where the balls start."
    )


def _rules(sections: Sequence[PageSection]) -> str:
    serve = {row[1]: row[3] for row in _table(sections, RULES)}
    alone = [name for name, row in ASKED.items() if _fails(sections, *row)]
    farther = [
        name for name, (figure, _) in ASKED.items()
        if name not in alone and _has(sections, figure, FARTHER)
        and _row(sections, figure, FARTHER)[3].endswith(DONE)
    ]  # fmt: skip
    worse = [name for name, row in OPTIMISED.items() if _fails(sections, *row)]
    again = [name for name in OPTIMISED if name not in worse]
    return (
        "4. The rules that scale the balls bring them near -180 deg for factors of "
        f"{serve['M, m with it']} in M and {serve['k, m against it']} in k (tried: 0.5 to 3). With "
        f"{_and(alone)}, another end time alone does the same; with {_and(farther)} it leads to "
        f"-540 or -900 deg. The best hold of 4.4 stays the best with {_and(again)}, not with "
        f"{_and(worse)}. The figures for a stiffer spring need the damping scaled too."
    )


def _five_balls(sections: Sequence[PageSection]) -> str:
    bars = {row[0]: row for row in _table(sections, BARS)}
    none, hold = bars["6.3 (b)"], bars["6.3 (c), 6.4 (a)"]
    share = 1.0 - float(hold[3]) / float(none[3])
    (choices,) = re.findall(
        r"([\d.]+ to [\d.]+) times over", _ours(sections, "6.3 (b), (c)", "less with")
    )
    _, _, draws, verdict = _row(sections, "6.3, 6.4", "means of ten")
    order = f"{draws.split()[0]} of all draws of ten starts show the printed order"
    if verdict.startswith(UNDECIDED):
        order += f", {verdict.split(': ')[-1].split()[0]} with {OTHERS_NAMED}: it is undecided"
    return (
        f"5. With five colliding balls the hold at 2500 rpm changes the whirl by {-share:+.0%}, "
        f"and {choices} times if mass, damping, friction or drag is halved or doubled. The "
        f"standard deviation of one start is {hold[5]} um at a mean of {hold[3]} um. "
        f"{order}. Match the balls to the unbalance, and try many starts."
    )


def _rows(sections: Sequence[PageSection]) -> list[list[str]]:
    """Of all statements."""
    return [
        row for section in sections for table in section.tables
        if table.columns[-1] == "verdict" for row in table.texts()
    ]  # fmt: skip


def _table(sections: Sequence[PageSection], title: str) -> list[list[str]]:
    """Rows of the one table whose title begins so."""
    (found,) = [
        table for section in sections for table in section.tables if table.title.startswith(title)
    ]
    return found.texts()


def _row(sections: Sequence[PageSection], figure: str, printed: str) -> list[str]:
    """The one row of a figure whose statement begins so."""
    (found,) = [row for row in _rows(sections) if row[0] == figure and row[1].startswith(printed)]
    return found


def _has(sections: Sequence[PageSection], figure: str, printed: str) -> bool:
    return any(row[0] == figure and row[1].startswith(printed) for row in _rows(sections))


def _ours(sections: Sequence[PageSection], figure: str, printed: str) -> str:
    return _row(sections, figure, printed)[2]


def _fails(sections: Sequence[PageSection], figure: str, printed: str) -> bool:
    return _row(sections, figure, printed)[3].startswith(FAILS)


def _and(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names) or "none"

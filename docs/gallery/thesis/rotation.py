"""Chapter 5: balls that fall behind the rotor, and where they come to rest."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from gallery.page import PageSection, Picture
from gallery.thesis.claims import ODD, at_odd, table_of
from gallery.thesis.drive import HOLD, THESIS, StartUp, Tell, start_ups
from gallery.thesis.many import ends
from gallery.thesis.pictures import SPEEDS, histories, written
from gallery.thesis.region import MAP_DRAGS, MAP_MASSES, map_picture, region
from gallery.thesis.rotation_claims import HELD, PAIRS, hold_claims, without_claims
from gallery.thesis.rotation_measures import HALF_SECOND, SETTLED, STILL
from gallery.thesis.rotation_ranges import (
    DRAGS,
    ECCENTRICITIES,
    MASSES,
    Ends,
    width_table,
)
from gallery.thesis.rotation_settled import FINE

MOST = 6.0
"""Ball positions that are shown over c_b, times -180 deg, as in the map."""


def rotation_sections(folder: Path, tell: Tell) -> tuple[PageSection, PageSection]:
    """Figures 5.1 to 5.12, and how wide the good region is."""
    tell("chapter 5", 0, 1)
    runs = histories_of()
    without = {n: runs[n] for n in PAIRS}
    held = {HELD[n]: runs[HELD[n]] for n in PAIRS}
    ends_drag, ends_e = over_drag(tell), over_eccentricity(tell)
    good = region(tell)
    first = PageSection(
        "5.1 Non-synchronous motion without a period: figures 5.1 to 5.6",
        (
            f"Times hold within {HALF_SECOND:g} s, angles within 25 deg. Balls have settled if "
            f"they stay within {SETTLED:g} deg for the last {STILL:g} s before 2.5 s after the "
            "critical speed. They keep the rotor's speed if they lag by less than 5 rad/s.",
        ),
        (table_of("Without a variable-speed period", without_claims(runs, ends_drag, ends_e)),),
        (
            histories(folder, "5.1", without, SPEEDS, "Figures 5.1 to 5.3"),
            _ends_picture(folder, "5.4", 0, ends_drag, ends_e),
        ),
    )
    second = PageSection(
        "5.2 Non-synchronous motion with a period: figures 5.7 to 5.12, and how wide it is good",
        (
            "The thesis does not state how exactly m and c_b must match. The map shows where "
            "both balls are opposite 2.5 s after the critical speed. They balance only at "
            "0.495 g, where 2 m R is M0 e.",
            f"Ranges of c_b: figures 5.5 and 5.11 with {len(DRAGS)} values from {DRAGS[0]:g} to "
            f"{DRAGS[-1]:g} N s/m; the map has {len(MAP_MASSES)} masses from "
            f"{1e3 * MAP_MASSES[0]:g} to {1e3 * MAP_MASSES[-1]:g} g and {len(MAP_DRAGS)} values "
            f"of c_b. Narrow ranges are refined with {FINE} values.",
        ),
        (
            table_of(
                "With a hold of 0.5 s",
                hold_claims(runs, ends_drag, ends_e),
            ),
            width_table(ends_drag, (at_odd(good[0]).mean(), at_odd(good[1]).mean())),
        ),
        (
            histories(folder, "5.7", held, SPEEDS, "Figures 5.7 to 5.9"),
            _ends_picture(folder, "5.10", 1, ends_drag, ends_e),
            map_picture(folder, good),
        ),
    )
    return first, second


def histories_of() -> dict[str, StartUp]:
    """By figure the runs of 5.1 to 5.3 and 5.7 to 5.9."""
    drives = {number: THESIS._replace(m=m, c_b=c_b) for number, (m, c_b) in PAIRS.items()}
    numbers = [*drives, *HELD.values()]
    cases = [(p, None) for p in drives.values()] + [(p, HOLD) for p in drives.values()]
    return dict(zip(numbers, start_ups(cases), strict=True))


def over_drag(tell: Tell) -> Ends:
    """Figures 5.5 and 5.11."""
    return _ends(tell, "figures 5.5 and 5.11", [{"c_b": float(c_b)} for c_b in DRAGS])


def over_eccentricity(tell: Tell) -> Ends:
    """Figures 5.6 and 5.12."""
    return _ends(tell, "figures 5.6 and 5.12", [{"e": float(e)} for e in ECCENTRICITIES])


def _ends(tell: Tell, what: str, changes: list[dict[str, Any]]) -> Ends:
    drives = [THESIS._replace(m=m, **change) for m in MASSES for change in changes]
    cases = [(p, None) for p in drives] + [(p, HOLD) for p in drives]
    angles = np.array([end.angle for end in ends(what, cases, tell)]).reshape(
        2, len(MASSES), len(changes)
    )
    return {m: (angles[0, k], angles[1, k]) for k, m in enumerate(MASSES)}


def _ends_picture(folder: Path, number: str, held: int, drag: Ends, eccentricity: Ends) -> Picture:
    """Figures 5.4 to 5.6, or 5.10 to 5.12."""
    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    time, over_drag, over_e = figure.subplots(1, 3)
    first, second, third = ("5.4", "5.5", "5.6") if held == 0 else ("5.10", "5.11", "5.12")
    drives = [(THESIS._replace(m=m), HOLD if held else None) for m in MASSES]
    for m, run in zip(MASSES, start_ups(drives), strict=True):
        label = f"{1e3 * m:g} g"
        time.plot(
            run.trajectory["time"] - 2.5, run.trajectory.ball_angles[:, 0] / -np.pi, label=label
        )
        over_drag.plot(DRAGS, drag[m][held] / -180.0, label=label)
        over_e.plot(1e6 * ECCENTRICITIES, eccentricity[m][held] / -180.0, label=label)
    time.set_xlim(0.0, 2.5)
    time.set_xlabel("time after the critical speed [s]")
    over_drag.set_xlabel("c_b [N s/m]")
    over_drag.set_xscale("log")
    over_drag.set_xticks([0.2, 0.5, 1.0, 2.0, 5.0], ["0.2", "0.5", "1", "2", "5"], minor=False)
    over_drag.xaxis.set_minor_formatter(NullFormatter())
    over_drag.set_ylim(0.0, MOST)
    over_e.set_xlabel("e [um]")
    time.set_ylabel("ball position, times -180 deg")
    for axes, name in ((time, first), (over_drag, second), (over_e, third)):
        axes.set_title(f"Fig. {name}", fontsize=11)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, title="m")
        for odd in ODD:
            axes.axhline(odd, color="0.6", lw=0.8, ls="--", zorder=0)
    what = "with a hold of 0.5 s" if held else "without a variable-speed period"
    caption = (
        f"Figures {first} to {third}: {what}; dashed: opposite to the unbalance; {second} "
        "continues above the plotted range"
    )
    return written(figure, folder, number, caption)

"""The NSC report on the relative stability of two-ball balancers (2007), computed again."""

from collections.abc import Callable
from pathlib import Path

from ab_sim.papers.page import Paper, Section
from ab_sim.papers.relative_stability.speed import speed_section

TITLE = "On the relative stability of multi-ball balancing systems"
SOURCE = (
    "Fu, Tsai, Wang: report of the project NSC 95-2221-E-002-202, National Taiwan University, "
    "2007 (in Chinese)."
)


def regenerate(folder: Path, tell: Callable[[str, int, int], None]) -> Paper:
    """The report's Tables 1 to 3 and figures 2 to 8."""
    sections: list[Section] = []
    parts = (("figure 4", speed_section),)
    for done, (name, part) in enumerate(parts):
        tell(name, done, len(parts))
        sections.append(part(folder))
    return Paper("relative-stability", TITLE, SOURCE, tuple(sections))

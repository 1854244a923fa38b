"""The NSC report on the relative stability of two-ball balancers (2007), computed again."""

from pathlib import Path

from gallery.page import Paper
from gallery.relative_stability.cases import Tell
from gallery.relative_stability.parameters import parameter_section
from gallery.relative_stability.recovering import (
    drag_section,
    strength_and_response_section,
    table_section,
    together_section,
)
from gallery.relative_stability.resting import resting_section
from gallery.relative_stability.speed import speed_section
from gallery.relative_stability.strength import strength_section

TITLE = "On the relative stability of multi-ball balancing systems"
SOURCE = (
    "Fu, Tsai, Wang: report of the project NSC 95-2221-E-002-202, National Taiwan University, "
    "2007 (in Chinese)."
)


_SECTIONS = (
    parameter_section,
    resting_section,
    strength_section,
    speed_section,
    drag_section,
    strength_and_response_section,
    table_section,
    together_section,
)


def regenerate(folder: Path, tell: Tell) -> Paper:
    """The report's Tables 1 to 3 and figures 2 to 8."""
    sections = tuple(section(folder, tell) for section in _SECTIONS)
    return Paper("relative-stability", TITLE, SOURCE, sections)

"""Lu and Hung's paper on the three-ball balancer (2008), computed again."""

from pathlib import Path

from gallery.page import PageSection, Paper
from gallery.three_ball.branches import branches_section
from gallery.three_ball.drive import MU_OVER_DELTA
from gallery.three_ball.growth import growth_section
from gallery.three_ball.regions import against_section, bell_section
from gallery.three_ball.responses import point_b_section, two_places_section
from gallery.three_ball.written import Tell

TITLE = "Stability Analysis of a Three-Ball Automatic Balancer"
SOURCE = (
    "C.-J. Lu, C.-H. Hung, Journal of Vibration and Acoustics 130, 2008, DOI 10.1115/1.2948415."
)
LEFT_OUT = PageSection(
    "What the paper leaves out",
    (
        "The figures lack zeta, zeta_B, mu, delta and the ranges of their axes; the only "
        "numbers are the thresholds of figures 2 and 5. Only mu / delta matters; here it is "
        f"{MU_OVER_DELTA:g}. Ω = ω/ω_n, η = m_b d / (m_d e), ζ = C / (2 M ω_n), ζ_B = C_B / (2 "
        "m_b ω_n), r = W/e.",
        "Errors: (9) prints C for C_B in zeta_B; the third term of (4) must be "
        "-2 ω x' y; tan^-1 in (17)-(29) must be atan2.",
    ),
)
_SECTIONS = (
    growth_section,
    branches_section,
    bell_section,
    two_places_section,
    against_section,
    point_b_section,
)


def regenerate(folder: Path, tell: Tell) -> Paper:
    """The paper's figures 2 to 9."""
    sections = tuple(section(folder, tell) for section in _SECTIONS)
    return Paper("three-ball", TITLE, SOURCE, (LEFT_OUT, *sections))

"""Rodrigues, Champneys, Friswell and Wilson's two-plane balancer and rig, computed again."""

from pathlib import Path

from gallery.page import PageSection, Paper
from gallery.two_plane.against_printed import check_section
from gallery.two_plane.borders import border_section
from gallery.two_plane.frequencies import frequency_section
from gallery.two_plane.rig_balls import ball_section
from gallery.two_plane.rig_frequencies import rig_frequency_section
from gallery.two_plane.rig_plain import plain_section
from gallery.two_plane.rotor import NAME, Tell
from gallery.two_plane.runs import run_section

TITLE = "Automatic two-plane balancing for rigid rotors"
SOURCE = (
    "D. J. Rodrigues, A. R. Champneys, M. I. Friswell and R. E. Wilson, University of Bristol: "
    "Automatic two-plane balancing for rigid rotors, Int. J. Non-Linear Mechanics 43 (2008), "
    "527-541; A consideration of support asymmetry in an automatic ball balancing system, "
    "ENOC-2008; Experimental investigation of a single-plane automatic balancing mechanism for a "
    "rigid rotor, 2010 (hdl.handle.net/1983/1588). Read from the preprints that the first author "
    "has published with his thesis (github.com/djr41/thesis)."
)


def regenerate(folder: Path, tell: Tell) -> Paper:
    """The papers' critical speeds, borders, runs and levels."""
    sections = (
        _assumed(),
        frequency_section(),
        border_section(folder, tell),
        run_section(folder, tell),
        check_section(),
        rig_frequency_section(),
        plain_section(folder, tell),
        ball_section(folder, tell),
    )
    return Paper(NAME, TITLE, SOURCE, sections)


def _assumed() -> PageSection:
    """What the papers leave out, and what is ours."""
    return PageSection(
        "What the papers leave out",
        (
            "The rotor has two bearings and balls in races at two heights (`race.height` and "
            "`balls.race`). The papers of 2008 use dimensionless parameters; here M = 1 kg, R "
            "= 1 m and k11 = 1 N/m, so that Omega_1 = 1 rad/s.",
            "Values that appear only in figures were read from the vector curves of the "
            "preprints, to about 2 in the last digit given.",
            "Our deck can also move along the shaft and turn about it, on springs that nothing "
            "excites. 1 % of the mass and the inertia J_t - J_p do not turn.",
            "Not computed: stability charts of the unequal devices, limit cycles, the run-up "
            "through the critical speeds (VIRM 2008).",
        ),
    )

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
            "A rigid rotor on two bearings, with balls in races at two heights: `race.height` is a "
            "list, and `balls.race` says where each ball runs. All parameters are printed. The "
            "papers of 2008 have none with dimensions: here M = 1 kg, R = 1 m, k11 = 1 N/m, so "
            "that Omega_1 = 1 rad/s.",
            "What the papers give in figures only is read from their curves and markers, which are "
            "vectors in the preprints: to some 2 in the last digit that is given.",
            "Our deck moves along the shaft and turns about it, too. That is held by springs which "
            "nothing excites, along the shaft as stiffly as across it, about it twice as stiffly "
            "as the tilt. And some of what moves must not turn: 1 % of the mass and J_t - J_p of "
            "the inertia across the shaft; only the sums count.",
            "Not computed: the stability charts of the unequal devices, the limit cycles, and the "
            "run-up through the critical speeds (VIRM 2008).",
        ),
    )

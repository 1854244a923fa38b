"""Kim and Chung's deck in space with a ball balancer (2002), computed again."""

from pathlib import Path

from gallery.deck_3d.case import NAME, Tell
from gallery.deck_3d.maps import map_section
from gallery.deck_3d.responses import response_section
from gallery.deck_3d.verdicts import border_section, verdict_section
from gallery.page import PageSection, Paper

TITLE = "Dynamic analysis of an optical disk drive with an automatic ball balancer"
SOURCE = (
    "Kang Sung Kim and Jintai Chung, Department of Mechanical Engineering, Hanyang University, "
    "2002 (in Korean)."
)


def regenerate(folder: Path, tell: Tell) -> Paper:
    """The paper's figures 4 to 13, and its claims put to the test."""
    sections = (
        _assumed(),
        verdict_section(folder, tell),
        map_section(folder, tell),
        border_section(folder, tell),
        response_section(folder, tell),
    )
    return Paper(NAME, TITLE, SOURCE, sections)


def _assumed() -> PageSection:
    """What the paper leaves out, and what is ours."""
    return PageSection(
        "What the paper leaves out",
        (
            "The paper prints only d = .03 m, six natural frequencies and the balanced angle. "
            "The scene `feeding-deck` reproduces all seven results: M_P = .1 kg, M = .03 kg, m "
            "= .2 g, a = b = .12 m, d = R = .03 m, k = 1063.1 N/m per mount, eps = .316489 mm. "
            "The damping c = .6 N s/m per mount, the drag D = 1e-5 N m s and the ball mass are "
            "a choice; only the verdicts depend on them.",
            "Ours are the equations of the exact rigid body; the paper's (13) to (19) are the "
            "small-angle form. Errors: (13) and (14) have y for gamma; (15) lacks -4 "
            "d k alpha and -M eps w^2 sin(wt) alpha, and has -4 c d alpha' twice; (16) keeps 4 d k "
            "Y + 4 c d Y', of second order; (18) has J_Py for J_Pz, n m R for n m R^2, and Y for "
            "gamma.",
            "Also not stated: the mounts' axes, the reference point of the disc's inertia, the "
            "start and length of the time responses.",
        ),
    )

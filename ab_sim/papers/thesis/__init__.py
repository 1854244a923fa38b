"""Yoshida's doctoral thesis on start-ups of drives with a ball balancer (2014), computed again."""

from collections.abc import Sequence
from pathlib import Path

from ab_sim.papers.page import Paper, Section
from ab_sim.papers.thesis.claims import FAILS, HOLDS
from ab_sim.papers.thesis.drive import Tell
from ab_sim.papers.thesis.experiment import experiment_section
from ab_sim.papers.thesis.pictures import NAME
from ab_sim.papers.thesis.rotation import rotation_sections
from ab_sim.papers.thesis.rules import rules_section
from ab_sim.papers.thesis.settling import settling_section
from ab_sim.papers.thesis.with_period import period_sections
from ab_sim.papers.thesis.without_period import without_period_section

TITLE = "Reduction Method of Residual Balancing Error in Auto-Balancer and its Motion Analysis"
SOURCE = "Shuichi Yoshida, doctoral thesis, Kyoto Institute of Technology, 2014; chapters 4 to 6."
LEFT_OUT = Section(
    "What the thesis leaves out, and its slips",
    (
        "The acceleration before and after the period is 40 rad/s², twice the printed half, "
        "20 rad/s². Balls start at rest on the race; a = 1 mm where it is not said. Figures end "
        "2.5 s after the critical speed. Rolling friction has the arm beta_b (a length), opposes "
        "sliding only while the race pushes, and may hold a ball; the integrator locates that. "
        "(2-15) prints |sin gamma|: its figures show the signed form, which is taken here.",
        "Ranges of the axes of figures 5.5, 5.6, 5.11 and 5.12 and of the masses in them are in "
        'the figures only. "Settling" means the first instant at -180 deg, not rest there.',
    ),
)


def regenerate(folder: Path, tell: Tell) -> Paper:
    """Figures 4.1 to 6.6, each statement of chapters 4 to 6 with a verdict."""
    sections = (
        without_period_section(folder, tell),
        *period_sections(folder, tell),
        settling_section(folder, tell),
        rules_section(folder, tell),
        *rotation_sections(folder, tell),
        experiment_section(folder, tell),
    )
    return Paper(NAME, TITLE, SOURCE, (_in_short(sections), LEFT_OUT, *sections))


def _in_short(sections: Sequence[Section]) -> Section:
    """What holds, what does not, and what to take from it."""
    verdicts = [
        str(row[-1]) for section in sections for table in section.tables
        if table.columns[-1] == "verdict" for row in table.rows
    ]  # fmt: skip
    hold = sum(verdict == HOLDS for verdict in verdicts)
    fail = sum(verdict.startswith(FAILS) for verdict in verdicts)
    return Section(
        "In five lines",
        (
            f"1. Of {hold + fail} statements {hold} hold: mainly what a run shows, peaks, forces, "
            "end positions. What fails is mainly what is concluded from them.",
            '2. "Residual balance is eliminated" is not so: two balls of 1 g at -180 deg leave '
            "1.04 of the disc's unbalance, and at rest at 200 rad/s W/e is 1.37 with the hold as "
            "without. Balls that match, 2 m R = M0 e, end at 0.06 with the hold, at 0.12 without.",
            "3. Soonest at -180 deg does not say how a drive ends: no period, and nearly every "
            "period of the grid, ends in one state. The best duration depends on where the balls "
            "start.",
            "4. The rules that scale the balls with M and k bring them near -180 deg over most of "
            "a factor of 0.5 to 3, and the end time alone does it where another m is asked for "
            "(M, k, c, e). But near -180 deg is balance only where 2 m R = M0 e. A stiffer spring "
            "comes out as printed if the damping is scaled, too.",
            "5. With five balls that collide the hold at 2500 rpm lowers the whirl by a twentieth "
            "only, and where they start decides more: ten starts cannot tell the four cases apart. "
            "Match the balls to the unbalance, judge by the final whirl, and try many starts.",
        ),
    )

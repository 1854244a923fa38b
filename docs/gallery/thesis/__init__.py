"""Yoshida's doctoral thesis on start-ups of drives with a ball balancer (2014), computed again."""

from pathlib import Path

from gallery.page import PageSection, Paper
from gallery.thesis.drive import Tell
from gallery.thesis.experiment import experiment_section
from gallery.thesis.head import in_short
from gallery.thesis.pictures import NAME
from gallery.thesis.rotation import rotation_sections
from gallery.thesis.rules import rules_section
from gallery.thesis.settling import settling_section
from gallery.thesis.shown import shown
from gallery.thesis.with_period import period_sections
from gallery.thesis.without_period import without_period_section

TITLE = "Reduction Method of Residual Balancing Error in Auto-Balancer and its Motion Analysis"
SOURCE = "Shuichi Yoshida, doctoral thesis, Kyoto Institute of Technology, 2014; chapters 4 to 6."
LEFT_OUT = PageSection(
    "What the thesis leaves out, and its slips",
    (
        "The acceleration outside the period is 40 rad/s²; the print gives its half, 20 "
        "rad/s². Balls start at rest on the race; a = 1 mm unless stated. Figures end 2.5 s "
        "after the critical speed. Rolling friction has the arm beta_b (a length), acts only "
        "while the race pushes, and may hold a ball. (2-15) prints |sin gamma|; its figures "
        "show the signed form, used here. The largest force is the largest before it first "
        "reverses.",
        "Contradictions: the peak of 4.1 is 55 in section 4.1 and 53 in section 4.5. In 4.30 "
        'the effect is "slightly excessive" and the balls go to -300 deg in one sentence; the '
        "number is judged. 4.45 has m = 2 g in its caption and 1.3 g in its text, which is judged. "
        'In 5.2 balls "settle near -540" and at -600 deg; both are judged. Section 5.1 takes M e '
        "as the disc's unbalance; here it is M0 e, M0 = M - 2 m, 2 % less with 1 g.",
        "Where the Japanese and English texts differ, the Japanese is judged. The force of "
        "4.27 is 1/3 of that of 4.25 (English: 2/3), of 4.26 1/3 or less (about 1/3 times "
        "less), of 4.29 1.8 times or more (about 1.8 times more). W/e of 4.1 peaks at about "
        "2.8 s (no time). Balls do not reach -180 deg in 4.13 and 4.14 (not immediately). 4.10 "
        "corresponds to 4.9 (4.8). In 5.1 balls turn backwards relative to the rotor (head of "
        "chapter 5: opposite to the motor). The end time alone is difficult in 4.44 (not "
        "sufficient). 5.5, 5.6, 5.11 and 5.12 show positions 2.5 s after the critical speed "
        "(of settled balls). 6.3 shakes less with a period (much less). In 4.30, 5.8 and 5.9 "
        '"greatly" differs, in 4.34 to 4.37, 5.6, 5.12 and 6.4 (a) other wording. The English '
        "of 4.15 to 4.17 applies to 4.18 in Japanese, which decelerates.",
        "Axis ranges of 5.5, 5.6, 5.11 and 5.12 are read from the figures. Section 4.4's "
        '"settling period" ends when both balls first reach -180 deg; in chapter 5 balls "have '
        'settled" when they stay in place.',
        "Not judged: the value of simulation and the novelty of the method (4.4, 4.5, 7), the "
        "set-up (6.1, 6.2), noise (chapter 5), vertical vibration (6.2).",
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
    report = (in_short(sections), LEFT_OUT, *sections)
    return Paper(NAME, TITLE, SOURCE, report, shown(report))

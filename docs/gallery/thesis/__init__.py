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
from gallery.thesis.with_period import period_sections
from gallery.thesis.without_period import without_period_section

TITLE = "Reduction Method of Residual Balancing Error in Auto-Balancer and its Motion Analysis"
SOURCE = "Shuichi Yoshida, doctoral thesis, Kyoto Institute of Technology, 2014; chapters 4 to 6."
LEFT_OUT = PageSection(
    "What the thesis leaves out, and its slips",
    (
        "The acceleration before and after the period is 40 rad/s², twice the printed half, "
        "20 rad/s². Balls start at rest on the race; a = 1 mm where it is not said. Figures end "
        "2.5 s after the critical speed. Rolling friction has the arm beta_b (a length), opposes "
        "sliding only while the race pushes, and may hold a ball; the integrator locates that. "
        "(2-15) prints |sin gamma|: its figures show the signed form, which is taken "
        "here; a largest force is the largest until it first reverses.",
        "Slips: the peak of 4.1 is 55 in section 4.1 and 53 in section 4.5. The effect in 4.30 is "
        '"slightly excessive" and the balls go to -300 deg in one sentence: the figure is judged. '
        "4.45 has m = 2 g in its caption, 1.3 times 1 g in its text, which is judged. Balls "
        '"settle near -540" and at -600 deg in one figure, 5.2: both are judged. The disc\'s '
        "unbalance is M0 e here, M0 = M - 2 m; section 5.1 takes M e, 2 % more with 1 g.",
        "The thesis is in Japanese and in English. Where they differ, what the author says in "
        "Japanese is judged: the force of 4.27 is only 1/3 of that of 4.25 (the English: 2/3), of "
        "4.26 1/3 or less (about 1/3 times less), of 4.29 1.8 times or more (about 1.8 times "
        "more); W/e of 4.1 is largest at about 2.8 s (no time), of 4.34 a little smaller "
        "(suppressed); in 4.35 and 4.37 the end time or m is finely adjusted (not only the end "
        "time, but also m); balls do not reach -180 deg in 4.13 and 4.14 (not immediately); 4.10 "
        "corresponds to 4.9 (4.8); in 4.30 the balls go beyond -180 deg (greatly beyond); in "
        "section 5.1 they turn backwards relative to the rotor (out of step with it; the head of "
        'chapter 5 has "opposite to the motor" in both); the end time alone makes it difficult in '
        "4.44 (is not sufficient); in 5.8 and 5.9 they go greatly beyond -540 and -180 deg "
        "(beyond); 5.8 has their movement promoted too much (promoted); 5.5, 5.6, 5.11 and 5.12 "
        "show positions 2.5 s after the critical speed (of balls that have settled); 5.6 and 5.12 "
        "are of a mass with which balls can balance (properly tuned); in 6.3 it shakes less with a "
        "period (much less); of 6.4 (a) balls are estimated near -180 deg (and the residual "
        "unbalance is improved). Of figures 4.15 to 4.18 the Japanese says what "
        "the English says of 4.15 to 4.17, which is judged: 4.18 decelerates.",
        "Ranges of the axes of figures 5.5, 5.6, 5.11 and 5.12 and of the masses in them are in "
        "the figures only. The thesis settles in two ways, and so does this page: section 4.4's "
        '"settling period" is until both balls first are at -180 deg, chapter 5\'s balls "have '
        'settled" when they stay where they are.',
        "Without a row is what no run here can decide: that equations alone would be difficult "
        "(4.5), what simulation saves in time and effort (4.4, 7), that adjustments can be found "
        "by it (4.5; rows of 4.35 and 4.37 show what they do), that the method is new, that "
        "it serves any device of the same model (4.5, 7), what cannot be measured, and the set-up "
        "(6.1, 6.2); noise (chapter 5) and vertical vibration (6.2) are not computed.",
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
    return Paper(NAME, TITLE, SOURCE, (in_short(sections), LEFT_OUT, *sections))

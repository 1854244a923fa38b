"""Every ball that a scene may have has a curve of its own look."""

from ab_sim.figures.balls import BALLS, ball_styles
from ab_sim.figures.dashes import dashes_of
from ab_sim.reports.colours import CURVES
from ab_sim.scene.model import MAX_BALLS


def test_no_two_balls_look_alike() -> None:
    looks = {(style["color"], style["dashes"]) for style in ball_styles(MAX_BALLS)}
    assert len(looks) == MAX_BALLS and len(set(BALLS)) == len(BALLS)
    report = {(CURVES[k % len(CURVES)], dashes_of(k, len(CURVES))) for k in range(MAX_BALLS)}
    assert len(report) == MAX_BALLS

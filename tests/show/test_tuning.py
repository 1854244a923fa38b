"""Pictures of tunings."""

import numpy as np

import ab_sim
from ab_sim.show.many_runs import LEFT_OUT

MASS = {"balls.mass": "0.5 g..0.9 g"}


def test_axes_say_what_they_are_and_candidates_that_do_not_balance_are_marked() -> None:
    found = ab_sim.tune("balanced-start-up", MASS, minimise="final_whirl_over_e", runs=16)
    figure = found.plot()
    (axes,) = figure.axes
    assert axes.get_xlabel() == "m, mass of a ball\nballs.mass [kg]"
    assert axes.get_ylabel() == "final W/e\nfinal_whirl_over_e [e]"
    count = found.runs.outcomes["not balanced"]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"white inside: not balanced: {count}" in texts


def test_candidates_without_a_value_are_at_the_edge() -> None:
    scene = ab_sim.load_scene("balanced-start-up", ["duration=0.9"])
    found = ab_sim.tune(scene, MASS, minimise="in_band_from", runs=16)
    figure = found.plot()
    edge = [line for line in figure.axes[0].get_lines() if line.get_marker() == "x"]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    count = found.runs.outcomes["not balanced, still changing"]
    assert [len(np.atleast_1d(line.get_xdata())) for line in edge] == [count]
    assert f"without a value, e.g. not balanced; at the upper edge: {count}" in texts


def test_candidates_that_are_left_out_are_drawn_and_counted() -> None:
    scene = ab_sim.load_scene("balanced-start-up", ["duration=2.5"])
    found = ab_sim.tune(scene, MASS, minimise="final_whirl_over_e", runs=16)
    count, better = found.left_out["not balanced, still changing"]
    assert count == found.runs.outcomes["not balanced, still changing"] > better > 0
    assert not found.scores.within[found.runs["outcome"] == "not balanced, still changing"].any()
    figure = found.plot()
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"left out: not settled, at their end: {count}" in texts
    lines = [line for line in figure.axes[0].get_lines() if line.get_markeredgecolor() == LEFT_OUT]
    assert [int(np.isfinite(line.get_ydata()).sum()) for line in lines] == [count]

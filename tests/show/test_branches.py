"""The branch diagram: what is in it is said."""

from pathlib import Path

import matplotlib
import numpy as np

from ab_sim.analysis.equilibria import branches_over_speed, equilibria_of
from ab_sim.scene import load_scene
from ab_sim.show.resting import drawn_branches
from ab_sim.show.saved import save


def test_patterns_and_what_happens_to_them_are_named(tmp_path: Path) -> None:
    scene = load_scene("nsc-case-3")
    over_speed = branches_over_speed(scene, np.linspace(100.0, 400.0, 7))
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure = drawn_branches(scene, equilibria_of(scene, 300.0), over_speed)
        save(figure, tmp_path / "b.svg", 110)
    text = (tmp_path / "b.svg").read_text()
    for words in (
        "nsc-case-3", "2+0", "1+1", "0+2", "balanced", "unstable", "fold", "stability changes",
        "no stable state", "W/e", "theta [deg]", "spindle speed [rad/s]",
    ):  # fmt: skip
        assert words in text, words

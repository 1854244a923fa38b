"""The Campbell diagram of every kind of scene: what is in it is said, and nothing else."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib import image
from matplotlib.figure import Figure

from ab_sim.analysis.modes import vibration_of
from ab_sim.scene import Scene, load_scene
from ab_sim.show.resting import drawn_campbell
from ab_sim.show.saved import save


def texts_of(scene: Scene, file: Path) -> str:
    """The figure as SVG, with text as text, not as outlines."""
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        save(drawn_campbell(vibration_of(scene)), file, 110)
    return file.read_text(encoding="utf-8")


SENSES = {
    "feeding-deck": {"forward whirl", "backward whirl", "back and forth"},
    "thesis-hold": {"forward whirl", "backward whirl"},
    "on-edge": {"back and forth"},
}


@pytest.mark.parametrize("name", SENSES)
def test_branches_are_marked_by_the_sense_of_their_whirl(name: str, tmp_path: Path) -> None:
    text = texts_of(load_scene(name), tmp_path / "figure.svg")
    assert {sense for sense in SENSES["feeding-deck"] if sense in text} == SENSES[name]
    for words in (name, "once per revolution", "spindle speed [1/min]", "[Hz]", "balls spread"):
        assert words in text


def test_branches_are_named_by_what_moves(tmp_path: Path) -> None:
    text = texts_of(load_scene("feeding-deck"), tmp_path / "figure.svg")
    for words in ("364.7  tilt about y, tilt about x", "335.4  turn about z, X", "178.8  Z"):
        assert words in text


def test_damping_ratios_fill_their_panel(tmp_path: Path, drawn: list[Figure]) -> None:
    save(drawn_campbell(vibration_of(load_scene("thesis-hold"))), tmp_path / "figure.svg", 110)
    below = drawn[0].axes[1]
    assert below.get_ylabel() == "damping ratio [1]"
    most = float(np.nanmax(np.concatenate([line.get_ydata() for line in below.lines])))
    assert most <= below.get_ylim()[1] < 1.5 * most


@pytest.mark.parametrize("change", ["damping=40", "stiffness=0"])
def test_modes_that_do_not_swing(change: str, tmp_path: Path) -> None:
    file = tmp_path / "figure.png"
    scene = load_scene("no-ball", [f"effects.suspension.{change}"])
    save(drawn_campbell(vibration_of(scene)), file, 110)
    assert image.imread(file)[..., :3].std() > 0.05

"""Pictures of multipliers: what is in them is said."""

from pathlib import Path

import matplotlib
import pytest

from ab_sim.analysis.floquet import follow, solutions_of
from ab_sim.scene import load_scene
from ab_sim.show.multipliers import drawn_modulus, drawn_multipliers, stable_parts
from ab_sim.show.saved import save
from tests.analysis.floquet.scenes import plane

SVG = {"svg.fonttype": "none"}


def test_the_plane_names_each_solution_and_its_verdict(tmp_path: Path) -> None:
    found = solutions_of(load_scene("feeding-deck"), 130.0)
    with matplotlib.rc_context(SVG):
        save(drawn_multipliers(found), tmp_path / "f.svg", 110)
    text = (tmp_path / "f.svg").read_text()
    for words in (
        "feeding-deck at 130 rad/s", "deck at rest, balls at -217.7, -142.3 deg: unstable, largest "
        "1.02948", ": stable, largest 0.961249", "around 1",
    ):  # fmt: skip
        assert words in text


def test_over_a_parameter_the_border_is_labelled_and_the_stable_part_shaded(tmp_path: Path) -> None:
    scene = load_scene("feeding-deck")
    followed = follow("speed", lambda w: (scene, w), [150.0, 180.0, 220.0, 300.0], ["balanced"])
    with matplotlib.rc_context(SVG):
        save(drawn_modulus(followed), tmp_path / "f.svg", 110)
    text = (tmp_path / "f.svg").read_text()
    for words in ("feeding-deck over speed", "190.308", "stable", "unstable", "speed [rad/s]"):
        assert words in text
    assert "whirl" not in text, "the deck keeps still"
    low, high = zip(*stable_parts(followed), strict=True)
    assert low == (pytest.approx(190.308, abs=1e-3), 220.0) and high == (220.0, 300.0)


def test_where_none_is_found_is_marked(tmp_path: Path) -> None:
    """One ball too heavy, in a drive whose deck moves."""
    equal = {"stiffness_2": 1000.0, "damping_2": 0.2}
    scene = plane(
        balls={"count": 1, "mass": 2e-3}, start={"ball_angles": [1.0]},
        effects={"unequal_suspension": equal},
    )  # fmt: skip
    followed = follow("speed", lambda w: (scene, w), [60.0, 70.0, 100.0])
    assert followed.points[-1].solution is None
    with matplotlib.rc_context(SVG):
        save(drawn_modulus(followed), tmp_path / "f.svg", 110)
    text = (tmp_path / "f.svg").read_text()
    assert "none found" in text and "largest whirl" in text

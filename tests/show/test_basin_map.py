"""The picture of a basin: nothing covers what it says."""

import ab_sim
from ab_sim.base.presentation import NOTATION
from ab_sim.show.maps import drawn_basin
from tests.show.collisions import overlaps, written


def test_nothing_covers_its_words() -> None:
    scene = ab_sim.load_scene("thesis-hold", ["effects.rolling_friction=", "duration=4"])
    figure = drawn_basin(ab_sim.basin(scene, 4))
    texts = written(figure)
    assert NOTATION in " ".join(words for words, _ in texts)
    assert not list(overlaps(texts))
    (legend,) = figure.legends
    within = legend.get_window_extent()
    own = {text.get_text() for text in (*legend.get_texts(), legend.get_title())}
    assert not [words for words, box in texts if words not in own and box.overlaps(within)]

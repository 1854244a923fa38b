"""What is drawn side by side has colours that people can tell apart, however much it is."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from ab_sim.analysis.maps.verdicts import CLUSTERED, EVERYWHERE, SOMEWHERE, SPLIT, SPREAD
from ab_sim.figures import accuracy_cost, branches, stability_map
from ab_sim.figures.balls import BALLS, SPINDLE, ball_styles
from ab_sim.figures.colours import distinct_colours
from ab_sim.palette import Colour, distinct, oklab
from ab_sim.recording import colours as recorded
from ab_sim.reports.colours import CURVES
from ab_sim.scene.sections import MAX_BALLS

LEAST = 0.07
"""In OKLab, where black and white are 1 apart."""
LEAST_WITHIN_HUES = 0.05


def closest(colours: list[Colour] | list[str]) -> float:
    """The least distance of two."""
    numbers = [
        tuple(255 * part for part in to_rgb(one)) if isinstance(one, str) else one
        for one in colours
    ]
    places = oklab(np.array(numbers))
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    return float(apart[np.triu_indices(len(places), 1)].min())


@pytest.mark.parametrize(
    "first, avoid",
    [
        ((), ()),
        (BALLS, (SPINDLE,)),
        (CURVES, ()),
        (branches.COLOURS, ("k",)),
        (accuracy_cost.OURS, accuracy_cost.PEERS),
        (accuracy_cost.PEERS, accuracy_cost.OURS),
    ],
)  # fmt: skip
def test_any_number_of_curves_differ(first: tuple[str, ...], avoid: tuple[str, ...]) -> None:
    for count in range(2, MAX_BALLS + 1):
        colours = distinct_colours(count, first, avoid=avoid)
        assert len(colours) == count and closest(colours) > LEAST
        assert tuple(colours[: len(first)]) == first[:count], "known pictures stay as they are"
        assert colours == distinct_colours(MAX_BALLS, first, avoid=avoid)[:count]


def test_balls_in_a_recording_differ_from_each_other_and_from_what_has_a_meaning() -> None:
    hues = [recorded.hue(ball) for ball in range(MAX_BALLS)]
    assert hues[: len(recorded.HUES)] == list(recorded.HUES)
    assert closest(hues) > LEAST
    meant = (recorded.UNBALANCE, recorded.RESULTANT, recorded.RESIDUAL, recorded.BALANCED)
    assert all(closest([hue, one]) > LEAST for hue in hues for one in meant)
    assert recorded.hue(MAX_BALLS) not in hues, "more curves than balls"


def test_balls_in_a_picture_differ_in_colour_and_many_in_dashes_too() -> None:
    styles = ball_styles(MAX_BALLS)
    assert closest([style["color"] for style in styles]) > LEAST
    assert len({style["dashes"] for style in styles}) > 1


def test_labels_of_a_map_differ() -> None:
    """Every combination of states with whirl, alone and beside balance."""
    kinds = (CLUSTERED, SPLIT, SPREAD)
    only = [sum(some) for many in (1, 2, 3) for some in combinations(kinds, many)]
    too = [whirling | balance for whirling in only for balance in (EVERYWHERE, SOMEWHERE)]
    labels = [*stability_map.COLOURS, *only, *too]
    colours = stability_map.colours_of(labels)
    assert set(colours) == set(labels)
    assert closest(list(colours.values())) > LEAST_WITHIN_HUES


def test_the_first_colours_do_not_depend_on_how_many_follow() -> None:
    assert distinct(5) == distinct(40)[:5]

"""What is drawn side by side has colours that people can tell apart, however much it is."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from ab_sim.analysis.maps.verdicts import CLUSTERED, EVERYWHERE, SOMEWHERE, SPLIT, SPREAD
from ab_sim.base import palette
from ab_sim.base.palette import (
    BALANCED,
    FIRST_BALLS,
    GREY,
    RESULTANT,
    RUN,
    SERIES,
    UNBALANCE,
    Colour,
    ball_colour,
    distinct,
    oklab,
)
from ab_sim.scene.sections import MAX_BALLS
from ab_sim.show import costs, maps, resting
from ab_sim.show.styles import ball_styles, distinct_colours

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
        (resting.PATTERN_COLOURS, ("k",)),
        (costs.OURS, costs.PEERS),
        (costs.PEERS, costs.OURS),
    ],
)  # fmt: skip
def test_any_number_of_curves_differ(first: tuple[str, ...], avoid: tuple[str, ...]) -> None:
    for count in range(2, MAX_BALLS + 1):
        colours = distinct_colours(count, first, avoid=avoid)
        assert len(colours) == count and closest(colours) > LEAST
        assert tuple(colours[: len(first)]) == first[:count], "known pictures stay as they are"
        assert colours == distinct_colours(MAX_BALLS, first, avoid=avoid)[:count]


def test_balls_differ_from_each_other_and_from_what_has_a_meaning() -> None:
    balls = [ball_colour(ball) for ball in range(MAX_BALLS)]
    assert balls[: len(FIRST_BALLS)] == list(FIRST_BALLS)
    assert closest(balls) > LEAST
    meant = (UNBALANCE, RESULTANT, RUN, BALANCED, GREY)
    assert all(closest([ball, one]) > LEAST for ball in balls for one in meant)


@pytest.mark.parametrize("colour", [*FIRST_BALLS, *SERIES, BALANCED, RESULTANT, UNBALANCE, GREY])
def test_colours_are_seen_on_a_light_and_a_dark_ground(colour: Colour) -> None:
    """By the contrast of WCAG 2; Rerun's dark theme has a ground of (13, 16, 17)."""

    def luminance(shade: Colour) -> float:
        parts = np.array(shade) / 255.0
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    for ground in ((255, 255, 255), (13, 16, 17)):
        dark, light = sorted([luminance(colour), luminance(ground)])
        assert (light + 0.05) / (dark + 0.05) > 2.9


def test_balls_in_a_picture_differ_in_colour_and_many_in_dashes_too() -> None:
    styles = ball_styles(MAX_BALLS)
    assert closest([style["color"] for style in styles]) > LEAST
    assert len({style["dashes"] for style in styles}) > 1


def test_labels_of_a_map_differ() -> None:
    """Every combination of states with whirl, alone and beside balance."""
    kinds = (CLUSTERED, SPLIT, SPREAD)
    only = [sum(some) for many in (1, 2, 3) for some in combinations(kinds, many)]
    too = [whirling | balance for whirling in only for balance in (EVERYWHERE, SOMEWHERE)]
    labels = [*maps.COLOURS, *only, *too]
    colours = maps.colours_of(labels)
    assert set(colours) == set(labels)
    assert closest(list(colours.values())) > LEAST_WITHIN_HUES


def test_the_first_colours_do_not_depend_on_how_many_follow() -> None:
    assert distinct(5) == distinct(40)[:5]


def test_only_the_palette_has_colours_by_number() -> None:
    package = Path(palette.__file__).parents[1]
    numbers = {
        str(path.relative_to(package))
        for path in package.rglob("*.py")
        if re.search(r"[\"\']#[0-9a-f]{6}[\"\']", path.read_text(encoding="utf-8"), re.IGNORECASE)
    }
    assert numbers == set()

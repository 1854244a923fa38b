"""Colours of curves and areas by matplotlib's names, as many as there are."""

from collections.abc import Sequence

from matplotlib.colors import to_hex, to_rgb

from ab_sim.palette import ON_LIGHT, Colour, distinct


def distinct_colours(
    count: int,
    first: Sequence[str],
    *,
    avoid: Sequence[str] = (),
    lightness: tuple[float, float] = ON_LIGHT,
    hues: tuple[float, float] = (0.0, 360.0),
) -> list[str]:
    """Colours of which no two are alike, see `distinct`; the first as they are named."""
    found = distinct(
        count, [_of(one) for one in first], avoid=[_of(one) for one in avoid],
        lightness=lightness, hues=hues,
    )  # fmt: skip
    added = [to_hex((r / 255.0, g / 255.0, b / 255.0)) for r, g, b in found[len(first) :]]
    return [*first[:count], *added]


def _of(name: str) -> Colour:
    red, green, blue = (round(255.0 * part) for part in to_rgb(name))
    return red, green, blue

"""Family of maps for several values of a third parameter, such as the drag."""

import math
from typing import Any, NamedTuple

from ab_sim.analysis.maps.plane import SPEED, Plane
from ab_sim.analysis.maps.stability import StabilityMap, stability_map
from ab_sim.base.errors import InputError
from ab_sim.base.numbers import number_in
from ab_sim.base.presentation import Progress
from ab_sim.scene.load import changed_scene

MOST = 50
"""Largest number of values."""


class Family(NamedTuple):
    """Maps of one plane for several values of another key of the scene."""

    key: str
    values: tuple[float, ...]
    maps: tuple[StabilityMap, ...]
    """Maps, one per value."""

    def report(self) -> dict[str, Any]:
        """Return the family as JSON-able values."""
        maps = [map_.report() for map_ in self.maps]
        return {"key": self.key, "values": list(self.values), "maps": maps}


def values_of(text: str) -> tuple[str, tuple[float, ...]]:
    """Return the key and the values of ``KEY=V,V,...``.

    Raises:
        InputError: the text has another form; the message names the form.
    """
    key, equals, list_ = text.partition("=")
    try:
        values = tuple(number_in(value) for value in list_.split(","))
    except ValueError:
        values = ()
    if not (equals and key.strip() and values and all(map(math.isfinite, values))):
        raise InputError(
            f"each {text!r}: must be KEY=V,V,... with numbers, e.g. "
            "effects.viscous_drag.coefficient=0.1,0.2,0.4"
        )
    if len(values) > MOST or len({*values}) < len(values):
        raise InputError(f"each {text!r}: must be at most {MOST} values, no two the same")
    return key.strip(), values


def members(plane: Plane, key: str, values: tuple[float, ...]) -> list[Plane]:
    """Return a copy of the plane for each value of the key.

    Raises:
        InputError: the key is on an axis, or is not a key of a scene.
        SceneError: a value is not allowed; the message names it.
    """
    if key in (plane.across.key, plane.up.key, SPEED):
        raise InputError(f"each {key}: is on an axis, or the spindle's speed; name another key")
    planes = [
        plane._replace(scene=changed_scene(plane.scene, {key: value}, "each")) for value in values
    ]
    for plane_here in planes:
        plane_here.check()
    return planes


def family(
    plane: Plane,
    key: str,
    values: tuple[float, ...],
    coarse: int,
    workers: int = 1,
    tell: Progress | None = None,
) -> Family:
    """Compute a map for each value of the key.

    Further arguments and errors are those of ``stability_map`` and ``members``.
    """
    planes = members(plane, key, values)
    maps = tuple(stability_map(plane, coarse, workers, tell) for plane in planes)
    return Family(key, values, maps)

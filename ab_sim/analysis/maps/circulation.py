"""Where on a map all balls can circulate in one bunch, by the closed form."""

import itertools
from typing import Any

import numpy as np

from ab_sim.analysis.circulating import drive_of, stalled
from ab_sim.analysis.maps.plane import Axis, Plane
from ab_sim.analysis.maps.refine import Point
from ab_sim.scene.model import Scene

NOT_LOOKED_FOR = -1
"""The closed form does not know the scene: see ``circulating.why_not``."""
NONE_CIRCULATES = 0
CIRCULATES = 1
"""All balls, in a stable bunch."""
NOT_KNOWN = 2
"""The same, but swings are too large for the closed form."""
NAMES = {
    CIRCULATES: "balls can also circulate",
    NOT_KNOWN: "whether they can is not known",
}


def circulation_at(plane: Plane, point: Point) -> int:
    """Whether all balls can circulate in a stable bunch at a point (row, column): as above."""
    scene, speed = plane.at(*point)
    drive = drive_of(scene)
    if drive is None:
        return NOT_LOOKED_FOR
    if stalled(drive, speed, drive.balls) is not None:
        return CIRCULATES
    likely = stalled(drive, speed, drive.balls, known=False)
    return NONE_CIRCULATES if likely is None else NOT_KNOWN


def circulation_points(
    scene: Scene, speed: float, across: list[Any], up: list[Any]
) -> dict[str, Any]:
    """What is kept of a map's circulation, as ``stability.map_points`` of its labels."""
    axes = (Axis(key, tuple(np.linspace(*rest).tolist())) for key, *rest in (across, up))
    plane = Plane(scene, speed, *axes)
    rows, columns = plane.shape
    points = itertools.product(range(rows), range(columns))
    return {"points": [[*point, circulation_at(plane, point)] for point in points]}

"""Map points at which all balls can circulate in one bunch, by the closed form."""

import itertools
from typing import Any

import numpy as np

from ab_sim.analysis.circulating import drive_of, stalled
from ab_sim.analysis.maps.plane import Axis, Plane
from ab_sim.analysis.maps.refine import Point
from ab_sim.scene.model import Scene

NOT_LOOKED_FOR = -1
"""Code of a scene outside the closed form: see ``circulating.why_not``."""
NONE_CIRCULATES = 0
CIRCULATES = 1
"""Code of a point at which all balls can circulate in a stable bunch."""
NOT_KNOWN = 2
"""Code of a point with a bunch whose swings are too large for the closed form."""
NAMES = {
    CIRCULATES: "balls can also circulate",
    NOT_KNOWN: "whether they can is not known",
}


def circulation_at(plane: Plane, point: Point) -> int:
    """Return the code of circulation at a point (row, column)."""
    scene, speed = plane.at(*point)
    drive = drive_of(scene)
    if drive is None:
        return NOT_LOOKED_FOR
    if stalled(drive, speed, drive.balls) is not None:
        return CIRCULATES
    likely = stalled(drive, speed, drive.balls, known_only=False)
    return NONE_CIRCULATES if likely is None else NOT_KNOWN


def circulation_points(
    scene: Scene, speed: float, across: list[Any], up: list[Any]
) -> dict[str, Any]:
    """Return the cached data of a map's circulation, see ``stability.map_points``."""
    axes = (Axis(key, tuple(np.linspace(*rest).tolist())) for key, *rest in (across, up))
    plane = Plane(scene, speed, *axes)
    rows, columns = plane.shape
    points = itertools.product(range(rows), range(columns))
    return {"points": [[*point, circulation_at(plane, point)] for point in points]}

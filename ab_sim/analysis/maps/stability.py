"""Stability maps: kinds of stable resting states over two parameters of a scene."""

import functools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ab_sim.analysis.circulating import reason_not_covered
from ab_sim.analysis.equilibria.balanced import ALL, SAMPLED, known_positions
from ab_sim.analysis.equilibria.resting import resting_system, rotor_of
from ab_sim.analysis.maps.plane import SPEED, Plane
from ab_sim.analysis.maps.refine import Point, refined
from ab_sim.analysis.maps.verdicts import (
    BALANCED,
    CIRCULATES,
    EVERYWHERE,
    NOT_COVERED,
    NOT_KNOWN,
    circulation_at,
    name_of,
    verdict,
)
from ab_sim.analysis.result_cache import PointCheckpoint
from ab_sim.base.presentation import Column, Columns, Presented, Progress
from ab_sim.base.version import __version__
from ab_sim.base.workers import Workers

_AT_A_TIME = 16
"""Number of points that a process gets at a time."""
COARSE = 8
"""Default initial spacing of the points of a map."""


@dataclass(frozen=True, repr=False)
class StabilityMap(Presented):
    """Stability labels over a plane of two parameters; see ``ab_sim.stability_map``."""

    _picture = "stability_map"

    plane: Plane
    """Scene, speed and axes of the map."""
    coarse: int
    """Initial spacing of the points; ``refine`` explains which regions it can miss."""
    labels: np.ndarray
    """Label of every point (``verdicts``), integers, shape (values up, values across)."""
    computed: np.ndarray
    """Mask of computed points; the others have the label of their surroundings."""
    circulating: np.ndarray
    """Code of circulation of every point, same shape and refinement as ``labels``.

    1: all balls can circulate in a stable bunch. 0: they cannot. 2: swings are too large for the
    closed form. -1: the closed form does not cover the scene.
    """

    @property
    def balanced(self) -> np.ndarray:
        """Mask of points at which balance is stable at some position of the balls at least."""
        return (self.labels > 0) & ((self.labels & BALANCED) > 0)

    @property
    def balanced_everywhere(self) -> np.ndarray:
        """Mask of points at which balance is stable at all balanced positions."""
        return (self.labels > 0) & ((self.labels & EVERYWHERE) > 0)

    @property
    def shares(self) -> dict[int, float]:
        """Fractions of the plane by label, the largest first."""
        counted = Counter(self.labels.ravel().tolist())
        return {label: count / self.labels.size for label, count in counted.most_common()}

    @property
    def coexisting(self) -> np.ndarray:
        """Mask of points where balance is stable at some position and balls can circulate."""
        return self.balanced & (self.circulating == CIRCULATES)

    @property
    def reason_not_covered(self) -> str | None:
        """Reason why some point is outside the closed form of circulation; None if none is."""
        where = np.argwhere(self.circulating == NOT_COVERED)
        if len(where) == 0:
            return None
        return reason_not_covered(self.plane.at(int(where[0][0]), int(where[0][1]))[0])

    @property
    def balanced_positions(self) -> str | None:
        """Balanced positions that the labels cover; see ``balanced.known_positions``.

        ``SAMPLED`` if they are only sampled at some corner of the plane, else ``ALL``; None with
        fewer than three balls.
        """
        rows, columns = self.plane.shape
        kinds_at_corners = set()
        for row, column in ((0, 0), (0, columns - 1), (rows - 1, 0), (rows - 1, columns - 1)):
            system = resting_system(self.plane.at(row, column)[0])
            kinds_at_corners.add(known_positions(rotor_of(system), len(system.balls)))
        return next((kind for kind in (SAMPLED, ALL) if kind in kinds_at_corners), None)

    def _facts(self) -> dict[str, str]:
        rows, columns = self.plane.shape
        return {
            "scene": self.plane.scene.name,
            "points": f"{columns} x {rows}",
            "over": f"{self.plane.across.key} and {self.plane.up.key}",
            "balanced": f"{100.0 * self.balanced.mean():.3g} %",
        }

    def _columns(self) -> Columns:
        """Return a row per point, ordered by the value up, then across."""
        across, up = self.plane.across, self.plane.up
        labels = self.labels.ravel().tolist()
        names = {label: name_of(label) for label in {*labels}}
        units = self.plane.units
        return {
            across.key: Column(units[0], np.tile(across.values, len(up.values))),
            up.key: Column(units[1], np.repeat(up.values, len(across.values))),
            "stable": Column(None, [names[label] for label in labels]),
            "label": Column("1", labels),
            "computed": Column(None, self.computed.ravel()),
            "circulating": Column("1", self.circulating.ravel().tolist()),
        }

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        across, up = (
            {"key": axis.key, "values": list(axis.values)}
            for axis in (self.plane.across, self.plane.up)
        )
        return {
            "scene": self.plane.scene.name,
            "speed": None if SPEED in (across["key"], up["key"]) else self.plane.speed,
            "across": across,
            "up": up,
            "coarse": self.coarse,
            "points": self.labels.size,
            "computed": int(self.computed.sum()),
            "kinds": [
                {"label": label, "name": name_of(label), "share": share}
                for label, share in self.shares.items()
            ],
            "labels": self.labels.tolist(),
            "balanced_positions": self.balanced_positions,
            "circulation": {
                "labels": self.circulating.tolist(),
                "share": float((self.circulating == CIRCULATES).mean()),
                "share_coexisting": float(self.coexisting.mean()),
                "share_unknown": float((self.circulating == NOT_KNOWN).mean()),
                "reason_not_covered": self.reason_not_covered,
            },
            "version": __version__,
        }


def stability_map(
    plane: Plane, coarse: int = COARSE, workers: int = 1, tell: Progress | None = None
) -> StabilityMap:
    """Compute the labels of a plane; computed points are cached on disk.

    Parameters
    ----------
    plane
        Plane to be mapped.
    coarse
        Initial spacing of the points, a power of two; smaller islands may be missed (``refine``); 1
        computes every point.
    workers
        Number of processes; more than one needs a program with ``if __name__ == "__main__":``.
    tell
        Called with the current task, the number of finished points and the total so far. An
        exception in it ends the work.

    Raises
    ------
    SceneError
        A point gives no valid scene or has no resting states; the message names key and value.
    """
    plane.check()
    numbers = {
        "speed": plane.speed,
        **{
            name: [axis.key, axis.values[0], axis.values[-1], len(axis.values)]
            for name, axis in (("across", plane.across), ("up", plane.up))
        },
    }
    scene = plane.scene
    with (
        Workers(workers) as workers_,
        PointCheckpoint(label_at, scene, numbers) as labels,
        PointCheckpoint(circulation_at, scene, numbers) as codes,
    ):

        def verdicts(points: Sequence[Point]) -> list[int]:
            label = functools.partial(label_at, plane)
            compute = functools.partial(workers_.each, label, chunk=_AT_A_TIME)
            return labels.of(points, compute, "points near borders", tell)

        def circulation(points: Sequence[Point]) -> list[int]:
            code = functools.partial(circulation_at, plane)
            compute = functools.partial(workers_.each, code, chunk=_AT_A_TIME)
            return codes.of(points, compute, "balls that circulate", tell)

        grid = refined(verdicts, plane.shape, coarse)
        circulating = refined(circulation, plane.shape, coarse).labels
    return StabilityMap(plane, coarse, grid.labels, grid.computed, circulating)


def label_at(plane: Plane, point: Point) -> int:
    """Return the label of a plane's point (row, column); see ``verdicts.verdict``."""
    return verdict(*plane.at(*point))

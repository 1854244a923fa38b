"""Several maps of one plane: for values of a third parameter, or for two numbers of balls."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.maps.plane import SPEED, Plane
from ab_sim.analysis.maps.stability import StabilityMap, stability_map
from ab_sim.base.errors import InputError, SceneError
from ab_sim.base.numbers import number_in
from ab_sim.base.presentation import Progress
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

MOST = 50
"""Largest number of values of the third parameter, each of which takes a map."""


class Family(NamedTuple):
    """Maps of one plane for several values of another key of the scene."""

    key: str
    """Dotted key of the third parameter."""
    values: tuple[float, ...]
    """Values of the third parameter, SI."""
    maps: tuple[StabilityMap, ...]
    """Maps, one per value."""

    def report(self) -> dict[str, Any]:
        """Return the family as JSON-able values."""
        maps = [map_.report() for map_ in self.maps]
        return {"key": self.key, "values": list(self.values), "maps": maps}


def values_of(text: str) -> tuple[str, tuple[float, ...]]:
    """Parse ``KEY=V,V,...`` to the key and its values in SI units.

    Raises
    ------
    InputError
        The text has another form; the message names the form.
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

    Raises
    ------
    InputError
        The key is on an axis, or is not a key of a scene.
    SceneError
        A value is not allowed; the message names it.
    """
    if key in (plane.across.key, plane.up.key, SPEED):
        raise InputError(f"each {key}: is on an axis, or the spindle's speed; name another key")
    planes = [
        plane._replace(scene=changed_scene(plane.scene, {key: value}, "each")) for value in values
    ]
    for member in planes:
        member.check()
    return planes


def family(
    plane: Plane,
    key: str,
    values: tuple[float, ...],
    coarse: int,
    workers: int = 1,
    tell: Progress | None = None,
) -> Family:
    """Compute a map for each value of a third parameter.

    Parameters
    ----------
    plane
        Plane of the maps.
    key
        Dotted key of the third parameter.
    values
        Values of the key, SI.
    coarse, workers, tell
        See ``stability_map``.

    Raises
    ------
    InputError, SceneError
        See ``members`` and ``stability_map``.
    """
    planes = members(plane, key, values)
    maps = tuple(stability_map(plane, coarse, workers, tell) for plane in planes)
    return Family(key, values, maps)


DRAG = "effects.viscous_drag.coefficient"
"""Key of the drag."""


class StableShares(NamedTuple):
    """Shares of a map in which balance is stable for both numbers of balls, or for one only."""

    both: float
    """Share of the map in which balance is stable for both numbers of balls."""
    only_ours: float
    """Share of the map in which balance is stable only for the scene's number of balls."""
    only_other: float
    """Share of the map in which balance is stable only for the other number of balls."""

    @classmethod
    def of(cls, ours: np.ndarray, other: np.ndarray) -> "StableShares":
        """Return the shares from two masks of stable points with equal shapes."""
        parts = ours & other, ours & ~other, other & ~ours
        return cls(*(float(part.mean()) for part in parts))


class BallCountComparison(NamedTuple):
    """A map and the same map with another number of balls.

    For three and more balls "balance is stable" has two meanings: at some position at least (the
    three-ball paper's union of regions), and at all positions. From an arbitrary start only the
    second one guarantees balance.
    """

    ours: StabilityMap
    """Map of the scene."""
    other: StabilityMap
    """Map with the other number of balls."""

    @property
    def somewhere(self) -> StableShares:
        """Shares where balance is stable at some position at least."""
        return StableShares.of(self.ours.balanced, self.other.balanced)

    @property
    def everywhere(self) -> StableShares:
        """Shares where balance is stable at all positions."""
        return StableShares.of(self.ours.balanced_everywhere, self.other.balanced_everywhere)

    def report(self) -> dict[str, Any]:
        """Return the comparison as JSON-able values."""
        return {
            "balls": [m.plane.scene.balls.count for m in (self.ours, self.other)],
            "stable_at_some_position": self.somewhere._asdict(),
            "stable_at_every_position": self.everywhere._asdict(),
            "other": self.other.report(),
        }


def with_balls(scene: Scene, count: int) -> Scene:
    """Return the scene with another number of equal balls of the same total mass.

    The drag on each ball is scaled with its mass, so that drag per mass, the papers' zeta_B, is
    unchanged, as are M and M0. Start angles are removed.

    Raises
    ------
    SceneError
        The balls differ, there are none, or their number is not allowed.
    """
    if len({*scene.balls.masses}) != 1:
        raise SceneError(
            f"balls.mass: {scene.balls.count} balls of different masses, or none, cannot be "
            "compared with another number of balls; give all balls the same mass"
        )
    share = scene.balls.count / count if count else 0.0
    changes: dict[str, Any] = {"balls.count": count, "balls.mass": scene.balls.masses[0] * share}
    if isinstance(scene.balls.radius, tuple):
        changes["balls.radius"] = scene.balls.radius[0]
    if isinstance(scene.balls.race, tuple):
        changes["balls.race"] = scene.balls.race[0]
    drag = scene.effects.get("viscous_drag")
    if drag is not None:
        changes[DRAG] = drag.coefficient * share
    for key in ("ball_angles", "ball_rates"):
        if getattr(scene.start, key) is not None:
            changes[f"start.{key}"] = None
    return changed_scene(scene, changes, f"with {count} balls")


def plane_with_balls(plane: Plane, count: int) -> Plane:
    """Return the same plane with another number of balls, see ``with_balls``.

    Raises
    ------
    InputError
        The key of an axis depends on the number of balls.
    SceneError
        See ``with_balls``.
    """
    if count < 1:
        raise InputError(f"against {count} balls: must be at least 1")
    for key in (plane.across.key, plane.up.key):
        if key == DRAG or key.partition(".")[0] == "balls":
            raise InputError(
                f"against {count} balls: {key} is on an axis but depends on the number of "
                "balls; map another key"
            )
    return plane._replace(scene=with_balls(plane.scene, count))

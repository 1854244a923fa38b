"""Comparison of maps for two numbers of balls of the same total mass."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.maps.plane import Plane
from ab_sim.analysis.maps.stability import StabilityMap
from ab_sim.base.errors import InputError, SceneError
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

DRAG = "effects.viscous_drag.coefficient"


class StableShares(NamedTuple):
    """Shares of a map in which balance is stable for both numbers of balls, or for one only."""

    both: float
    only_ours: float
    only_other: float

    @classmethod
    def of(cls, ours: np.ndarray, other: np.ndarray) -> "StableShares":
        """Return the shares of two regions, given as booleans of one shape."""
        parts = ours & other, ours & ~other, other & ~ours
        return cls(*(float(part.mean()) for part in parts))


class BallCountComparison(NamedTuple):
    """A map and the same map with another number of balls.

    For three and more balls "balance is stable" has two meanings: at some position at least (the
    three-ball paper's union of regions), and at all positions. From an arbitrary start only the
    second one guarantees balance.
    """

    ours: StabilityMap
    other: StabilityMap

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

    Raises:
        SceneError: the balls differ, there are none, or their number is not allowed.
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

    Raises:
        InputError: the key of an axis depends on the number of balls.
        SceneError: see ``with_balls``.
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

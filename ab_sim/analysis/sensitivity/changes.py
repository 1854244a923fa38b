"""What a change of a scene's number makes of constants, start and profile: the chain's first link.

Constants follow from a scene by plain Python (``dynamics.assemble``): sums, products and quotients,
cosines of start angles, where a deck hangs at rest. They are differentiated by central differences
of eighth order, a hundredth of the number apart: what these leave out is some 1e-13 of a
derivative, of numbers that a sum hides some 1e-12. What is integrated is exact from there on.
"""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.sensitivity.keys import RealKey, moved, scale_of
from ab_sim.dynamics.assemble import start_state, system_of
from ab_sim.dynamics.layout import StateLayout
from ab_sim.dynamics.system import System
from ab_sim.errors import InputError
from ab_sim.kernels.constants import numbers_of, pattern
from ab_sim.scene.model import Scene
from ab_sim.spindle import ScheduledSegment, SpeedSchedule

WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
"""Of differences between one, two, three and four steps up and down: Fornberg (1988), Math. Comp.
51, table 1."""


class SceneChange(NamedTuple):
    """Derivatives by one key."""

    constants: np.ndarray
    """Of raw constants but for the place, as ``kernels.constants.numbers_of`` has them."""
    start: np.ndarray
    """Of the state at t = 0, shape (states,)."""
    spacing: np.ndarray
    """Of ``System.contacts``' distances, shape (contacts,)."""
    segments: tuple[np.ndarray, ...]
    """Of each segment of the profile: of its start and end [s], the spindle's angle at its start
    [rad], and its own numbers."""


def changes_by(scene: Scene, key: RealKey, layout: StateLayout) -> SceneChange:
    """Derivatives by a key.

    Args:
        scene: a checked scene.
        key: a number of it.
        layout: of its system's state.

    Raises:
        InputError: a little more or less of it makes another kind of scene.
    """
    base = _numbers(scene)
    angles = np.zeros(len(base.start), bool)
    angles[layout.angles] = True
    angles[layout.spindle][:1] = True
    step, found = scale_of(key), None
    for k, weight in enumerate(WEIGHTS, start=1):
        up, down = (_numbers(moved(scene, key.key, key.value + way * k * step)) for way in (1, -1))
        if not up.like(base) or not down.like(base):
            raise InputError(
                f"key {key.key}: a little more or less of it is another kind of scene, in which "
                "other things are computed; it has no derivative here"
            )
        apart = up.less(down, angles)
        part = [weight / step * x for x in apart]
        found = part if found is None else [a + b for a, b in zip(found, part, strict=True)]
    assert found is not None
    constants, start, spacing, *segments = found
    return SceneChange(constants, start, spacing, tuple(segments))


class _Numbers(NamedTuple):
    """All that follows from a scene."""

    system: System
    start: np.ndarray
    profile: SpeedSchedule

    def like(self, other: "_Numbers") -> bool:
        """Whether the same is computed of both."""
        kinds = [[type(s.segment) for s in each.profile.segments] for each in (self, other)]
        return pattern(self.system) == pattern(other.system) and kinds[0] == kinds[1]

    def less(self, other: "_Numbers", angles: np.ndarray) -> list[np.ndarray]:
        """Differences, as ``SceneChange`` has them; those of angles within half a turn."""
        start = self.start - other.start
        start[angles] -= 2.0 * math.pi * np.round(start[angles] / (2.0 * math.pi))
        pairs = zip(self.profile.segments, other.profile.segments, strict=True)
        return [
            numbers_of(self.system) - numbers_of(other.system),
            start,
            self.system.contacts[:, 1] - other.system.contacts[:, 1],
            *(_of_segment(one) - _of_segment(two) for one, two in pairs),
        ]


def _numbers(scene: Scene) -> _Numbers:
    system = system_of(scene)
    return _Numbers(system, start_state(scene, system), SpeedSchedule.of_scene(scene))


def _of_segment(scheduled: ScheduledSegment) -> np.ndarray:
    # What never ends does not end later.
    end = scheduled.end if math.isfinite(scheduled.end) else 0.0
    return np.array([scheduled.start, end, scheduled.start_angle, *scheduled.segment], float)

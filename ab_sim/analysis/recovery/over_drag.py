"""Recovery over the race's drag, the best drag, and a comparison with a single ball.

Relative-stability 5.2: with more drag the largest whirl falls and the settling time grows. The
composite index is their weighted sum t_c + r_p mean(t_c) / mean(r_p). It therefore depends on the
set of drags over which the means are taken.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import ab_sim
from ab_sim.analysis.recovery.response import BAND, Recovery, recover, speed_change_of
from ab_sim.analysis.results import Results
from ab_sim.base.errors import SceneError
from ab_sim.base.presentation import Column, Columns, Presented, Progress, number
from ab_sim.model.equations.neighbours import never_part, start_angles
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

DRAGS = (0.1, 0.2, 0.3, 0.4, 0.5)
"""Drags [N s/m] that reproduce the figures of relative-stability, which does not state any."""
DRAG = "effects.viscous_drag.coefficient"


@dataclass(frozen=True)
class Composite:
    """Composite index of settling time and maximum amplitude."""

    factor: float
    """Weight of the amplitude [s/m]."""
    index: tuple[float | None, ...]
    """Index at each drag [s]; None if the whirl does not settle."""
    best: int
    """Position of the smallest entry of ``index``."""


@dataclass(frozen=True, repr=False)
class RecoveryOverDrag(Presented):
    """Recovery of a scene at its own drag and others, and with one ball of the same mass.

    See ``ab_sim.recovery``.
    """

    _picture = "recovery"

    scene: str
    from_speed: float
    to_speed: float
    """Final speed [rad/s]; ``from_speed`` is the initial one."""
    band: float
    """Half-width of the band around the steady whirl [m]."""
    balls: int
    together: bool
    """True if balls start at one angle, where equal balls stay together."""
    drag: float
    """Drag of the scene [N s/m]."""
    own: Recovery
    drags: tuple[float, ...]
    """Drags [N s/m], rising."""
    over: tuple[Recovery, ...]
    """Recovery at each of ``drags``."""
    one_ball: tuple[Recovery, ...] | None
    """Recovery with one ball that has the mass of all balls.

    The first entry is at the scene's own drag, the others are at ``drags``. None if the scene has
    one ball.
    """

    @property
    def composite(self) -> Composite | None:
        """Composite index over ``drags``; None if the whirl settles at no drag."""
        return composite_of(self.over)

    @property
    def best_drag(self) -> float | None:
        """Drag with the smallest composite index [N s/m]."""
        return _best(self.drags, self.over)

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene,
            "speed": f"{self.from_speed:g} to {self.to_speed:g} rad/s",
            "settling time": number(self.own.settling_time, "s"),
            "amplitude": number(self.own.maximum_amplitude, "m"),
            "best drag": number(self.best_drag, "N s/m"),
        }

    def _columns(self) -> Columns:
        """Return a row per run: all balls, then one ball; each with the scene's drag first."""
        drags = (self.drag, *self.drags)
        runs = (self.own, *self.over, *(self.one_ball or ()))
        ways = len(runs) // len(drags)
        return {
            "balls": Column("1", [n for n in (self.balls, 1)[:ways] for _ in drags]),
            "drag": Column("N s/m", [*drags] * ways),
            "settling_time": Column("s", [run.settling_time for run in runs]),
            "maximum_amplitude": Column("m", [run.maximum_amplitude for run in runs]),
            "lambda_max": Column("1/s", [run.lambda_max for run in runs]),
            "label": Column(None, [run.label for run in runs]),
            "verdict": Column(None, [run.verdict for run in runs]),
        }

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see ``ab-sim recovery --help``."""
        one = self.one_ball
        return {
            "scene": self.scene,
            "from_speed": self.from_speed,
            "to_speed": self.to_speed,
            "band": self.band,
            "balls": self.balls,
            "drag": self.drag,
            **self.own._asdict(),
            "over_drag": _over(self.drags, self.over),
            "best_drag": self.best_drag,
            "one_ball": None
            if one is None
            else {
                **one[0]._asdict(),
                "over_drag": _over(self.drags, one[1:]),
                "best_drag": _best(self.drags, one[1:]),
            },
            "version": ab_sim.__version__,
        }


def _best(drags: Sequence[float], recoveries: Sequence[Recovery]) -> float | None:
    composite = composite_of(recoveries)
    return None if composite is None else drags[composite.best]


def composite_of(recoveries: Sequence[Recovery]) -> Composite | None:
    """Return the composite index of recoveries that differ in drag; None if none settles."""
    settled = [recovery for recovery in recoveries if recovery.settling_time is not None]
    if not settled:
        return None
    times = np.array([recovery.settling_time for recovery in settled], float)
    factor = float(times.mean() / np.mean([recovery.maximum_amplitude for recovery in settled]))
    index = tuple(
        None
        if recovery.settling_time is None
        else recovery.settling_time + factor * recovery.maximum_amplitude
        for recovery in recoveries
    )
    best = int(np.nanargmin(np.array(index, float)))
    return Composite(factor, index, best)


def recovery_over_drag(
    scene: Scene, drags: Sequence[float] = DRAGS, tell: Progress | None = None, band: float = BAND
) -> RecoveryOverDrag:
    """Return the recovery at the scene's own drag and others, with all balls and with one.

    Previous results are taken from the cache (``Results``).

    Args:
        scene: scene with balls, see ``recover``.
        drags: coefficients [N s/m].
        tell: called with the current task, the number of finished tasks and the total.
        band: half-width of the band around the steady whirl [m].

    Raises:
        SceneError, InputError, DivergedError: see ``recover``; or the scene has no balls, or does
            not accept a drag.
    """
    change = speed_change_of(scene)
    if scene.balls.count == 0:
        raise SceneError("balls.count = 0: must be at least 1 for a recovery over drag")
    drag = scene.effects["viscous_drag"].coefficient if "viscous_drag" in scene.effects else 0.0
    ways = [scene] if scene.balls.count == 1 else [scene, in_one_ball(scene)]
    work = [scene for way in ways for scene in (way, *(with_drag(way, drag) for drag in drags))]
    recoveries = []
    for done, scene_ in enumerate(work):
        if tell is not None:
            tell(_named(scene_), done, len(work))
        recoveries.append(kept_recovery(scene_, band))
    several = 1 + len(drags)
    return RecoveryOverDrag(
        scene.name,
        scene.start.speed,
        change.to_speed,
        band,
        scene.balls.count,
        bool(never_part(scene)),
        drag,
        recoveries[0],
        tuple(drags),
        tuple(recoveries[1:several]),
        tuple(recoveries[several:]) or None,
    )


def kept_recovery(scene: Scene, band: float = BAND) -> Recovery:
    """Return the result of ``recover``, from the cache if it was computed before."""
    return Recovery(**Results(_recovered).of(scene, band=band))


def _recovered(scene: Scene, band: float) -> dict[str, Any]:
    return recover(scene, band)._asdict()


def with_drag(scene: Scene, drag: float) -> Scene:
    """Return the scene with another drag of the race [N s/m].

    Raises:
        SceneError: the scene does not accept the drag.
    """
    return changed_scene(scene, {DRAG: drag}, "drag")


def in_one_ball(scene: Scene) -> Scene:
    """Return the scene with one ball of the total mass, at the mass-weighted mean angle."""
    balls = scene.balls
    mean = np.array(balls.masses) @ np.exp(1j * np.array(start_angles(scene)))
    radius = balls.radius[0] if isinstance(balls.radius, tuple) else balls.radius
    changes: dict[str, Any] = {
        "name": f"{scene.name}, one ball",
        "balls": {"count": 1, "mass": balls.total_mass, "race": balls.races[0]},
        "start.ball_angles": [float(np.angle(mean))],
        "start.ball_rates": [0.0],
    }
    if radius is not None:
        changes["balls"]["radius"] = radius
    return changed_scene(scene, changes, "one ball")


def _named(scene: Scene) -> str:
    drag = scene.effects["viscous_drag"].coefficient if "viscous_drag" in scene.effects else 0.0
    return f"{scene.balls.count} balls, drag {drag:g} N s/m"


def _over(drags: Sequence[float], recoveries: Sequence[Recovery]) -> list[dict[str, Any]]:
    composite = composite_of(recoveries)
    index = (None,) * len(drags) if composite is None else composite.index
    return [
        {"drag": drag, **recovery._asdict(), "composite_index": at}
        for drag, recovery, at in zip(drags, recoveries, index, strict=True)
    ]

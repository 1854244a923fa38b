"""Growth of a small disturbance of a periodic solution in a simulation, without Floquet."""

from typing import Any

import numpy as np

from ab_sim.analysis.floquet.stability import Stability
from ab_sim.analysis.floquet.turn import TurnMap
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene


def growth_of(scene: Scene, stability: Stability, turns: int, size: float = 1e-6) -> float:
    """Return the mean growth factor per spindle revolution, over the second half of a run.

    Two runs with the scene's solver start at the solution and at a point displaced in a random
    direction. Their distance is evaluated as a maximum over whole revolutions.

    Args:
        scene: scene of the periodic solution.
        stability: the solution.
        turns: duration in spindle revolutions; long enough that the fastest-growing direction
            dominates by the middle.
        size: size of the disturbance in units of ``TurnMap.scale``; small enough to be linear, and
            large compared with rounding.

    Returns:
        Factor that tends to the largest modulus of a multiplier for long runs.
    """
    turn = TurnMap(scene, stability.speed)
    away = np.random.default_rng(0).normal(size=turn.layout.size)
    way = turn.ways(stability.orbit.start)
    away = turn.scale * (way @ (way.T @ away))
    runs = [
        _run(scene, stability, turns, stability.orbit.start + share * away) for share in (0.0, size)
    ]
    length = round(stability.period / scene.solver.step)
    apart = np.abs(runs[0].position - runs[1].position).max(axis=1) / turn.scale[0]
    if not stability.structural:
        # Along a manifold of balanced positions, displaced balls neither return nor depart.
        balls = np.abs(runs[0].ball_angles - runs[1].ball_angles)
        apart = np.maximum(apart, balls.max(axis=1, initial=0.0))
    # Fast-decaying components have vanished by the middle.
    middle = len(apart) // 2
    first, last = apart[middle : middle + length].max(), apart[-length:].max()
    return float((last / first) ** (length / (len(apart) - length - middle)))


def _run(scene: Scene, stability: Stability, turns: int, state: np.ndarray) -> Trajectory:
    """Simulate ``turns`` revolutions from a state at the solution's speed."""
    most = max(scene.spindle.max_speed, abs(stability.speed))
    changes: dict[str, Any] = {"start.speed": stability.speed, "spindle.max_speed": most}
    if scene.profile is not None:
        changes["profile"] = None
    drive = Drive(changed_scene(scene, changes, "held"))
    drive.restore(drive.snapshot()._replace(state=state))
    return drive.advance(round(turns * stability.period / drive.step))

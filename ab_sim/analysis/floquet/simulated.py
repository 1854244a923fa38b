"""What a run makes of a small disturbance of a periodic solution: the answer without Floquet."""

from typing import Any

import numpy as np

from ab_sim.analysis.floquet.stability import Stability
from ab_sim.analysis.floquet.turn import TurnMap
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene


def growth_of(scene: Scene, found: Stability, turns: int, size: float = 1e-6) -> float:
    """By what a disturbance grows in a turn of the spindle, on the average over half of so many.

    Two runs of the drive, with the scene's solver: from the solution, and from beside it, in a
    direction at random. Both go their way; how far apart they are is seen along whole turns.

    Args:
        scene: the solution's.
        found: the solution.
        turns: of the spindle; so many that what grows fastest is all that is left in the middle.
        size: of the disturbance, in the units of ``TurnMap.scale``; small, as what is judged are
            small disturbances, and large beside rounding.

    Returns:
        A factor; for long runs the largest modulus of a multiplier.
    """
    turn = TurnMap(scene, found.speed)
    away = np.random.default_rng(0).normal(size=turn.layout.size)
    way = turn.ways(found.orbit.start)
    away = turn.scale * (way @ (way.T @ away))
    runs = [_run(scene, found, turns, found.orbit.start + share * away) for share in (0.0, size)]
    length = round(found.period / scene.solver.step)
    apart = np.abs(runs[0].position - runs[1].position).max(axis=1) / turn.scale[0]
    if not found.structural:
        # Along a manifold of balanced positions balls may stay where they are.
        balls = np.abs(runs[0].ball_angles - runs[1].ball_angles)
        apart = np.maximum(apart, balls.max(axis=1, initial=0.0))
    # What dies away fastest is gone by the middle.
    middle = len(apart) // 2
    first, last = apart[middle : middle + length].max(), apart[-length:].max()
    return float((last / first) ** (length / (len(apart) - length - middle)))


def _run(scene: Scene, found: Stability, turns: int, state: np.ndarray) -> Trajectory:
    """From a state on, so many turns at the solution's speed."""
    most = max(scene.spindle.max_speed, abs(found.speed))
    changes: dict[str, Any] = {"start.speed": found.speed, "spindle.max_speed": most}
    if scene.profile is not None:
        changes["profile"] = None
    drive = Drive(changed_scene(scene, changes, "held"))
    drive.restore(drive.snapshot()._replace(state=state))
    return drive.advance(round(turns * found.period / drive.step))

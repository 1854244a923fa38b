"""Where runs of the paper's drive settle, at speeds that are held."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim import Scene, Trajectory, simulate_batch
from ab_sim.analysis.metrics import metrics_of
from ab_sim.base.presentation import last_stretch

STARTS = ((0.01, 0.02, 0.03), (0.30, 0.32, 0.34))
"""Ball angles of the paper's two starts, in pi; balls and deck rest on axes that turn with the
rotor."""

STILL = 0.005
"""Of a ball that has settled: how far it moves over the last tenth of the run [rad]."""


def at_rest_on_rotor(angles: Sequence[float], speed: float) -> dict[str, Any]:
    """A start as the paper has it, (8) with q' = 0: the balls turn with the rotor.

    The deck, undeflected, is at rest on either axes.
    """
    return {"start.speed": speed, "start.ball_angles": [math.pi * a for a in angles]}


def runs(scene: Scene, starts: Sequence[dict[str, Any]], every: int = 10) -> list[Trajectory]:
    """A run from each start, for the scene's duration."""
    return [run.trajectory for run in simulate_batch(scene, starts, every=every).runs]


def settled(trajectory: Trajectory, scene: Scene) -> tuple[float, tuple[float, ...]] | None:
    """W / e and ball angles [rad] at the end of a run; None where they still change."""
    metrics = metrics_of(trajectory, scene)
    e = scene.rotor.eccentricity
    low, high = metrics.span
    last = trajectory.ball_angles[-last_stretch(len(trajectory["time"])) :]
    moving = float(np.ptp(last, axis=0).max())
    if high - low > max(0.02 * metrics.final_whirl, 1e-3 * e) or moving > STILL:
        return None
    return metrics.final_whirl / e, metrics.final_ball_angles

"""Trajectories with known metrics."""

from typing import Any

import numpy as np

from ab_sim.drive.trajectory import Trajectory, channels_for
from ab_sim.model.equations.planar import Planar


def made(balls: int = 1, step: float = 1e-3, count: int = 1001, **channels: Any) -> Trajectory:
    names = channels_for(Planar.CHANNELS, balls)
    samples = np.zeros((count, len(names)))
    samples[:, 0] = np.arange(count)
    samples[:, 1] = samples[:, 0] * step
    for name, function in channels.items():
        samples[:, names.index(name)] = function(samples[:, 1])
    return Trajectory(names, samples)

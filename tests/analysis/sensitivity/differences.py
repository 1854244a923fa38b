"""Derivatives of runs by differences of whole runs: what exact ones are held to."""

from collections.abc import Sequence

import numpy as np

from ab_sim.analysis.sensitivity import Sensitivities
from ab_sim.analysis.sensitivity.keys import RealKey, moved, scale_of
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedSchedule

SHARES = (0.1, 1e-2, 1e-3)
"""Of ``scale_of``: an event must not cross a sample, and rounding must not count."""


def run_of(scene: Scene, steps: int) -> Trajectory:
    """From the start on."""
    drive = Drive(scene)
    return Trajectory.join([drive.present(), drive.advance(steps)])


def worst_of_keys(found: Sensitivities, shares: Sequence[float] = SHARES) -> dict[str, float]:
    """By key the largest error of the derivatives, as a share of the channel's largest one.

    Each by those differences of fourth order that agree best. Samples at breakpoints of the speed,
    where a derivative has two sides, do not count; nor do channels that a key hardly moves.
    """
    worst = {}
    breakpoints = SpeedSchedule.of_scene(found.scene).breakpoints
    smooth = [all(abs(t - b) > 1e-9 for b in breakpoints) for t in found.times]
    columns = [found.trajectory.channels.index(name) for name in found.channels]
    sizes = np.abs(found.trajectory.samples[:, columns]).max(axis=0)
    for k, key in enumerate(found.keys):
        real = RealKey(key, float(found.values[k]), found.key_units[k])
        errors = []
        for share in shares:
            step = share * scale_of(real)
            by = _differences(found, real, step)[:, columns][smooth].T
            most = np.abs(by).max(axis=1)
            moves = most * 100.0 * scale_of(real) / np.maximum(sizes, 1e-300)
            counts = (moves >= min(1e-4, moves.max())) & (most > 0.0)
            off = np.abs(found.derivatives[:, k][:, smooth] - by).max(axis=1)
            errors.append(float((off / np.maximum(most, 1e-300))[counts].max(initial=0.0)))
        worst[key] = min(errors)
    return worst


def _differences(found: Sensitivities, key: RealKey, step: float) -> np.ndarray:
    last = len(found.trajectory) - 1

    def at(count: int) -> np.ndarray:
        scene = moved(found.scene, key.key, key.value + count * step)
        return run_of(scene, last).samples

    return (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * step)

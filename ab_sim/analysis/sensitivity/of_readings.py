"""Derivatives of sensors' readings: of what they feel, through their low-pass.

Noise does not change; rounding to digits is left out; what is clipped at the range does not change.
"""

import math
from collections.abc import Sequence

import numpy as np

from ab_sim.analysis.sensitivity.along import derivative_along
from ab_sim.analysis.sensitivity.keys import RealKey
from ab_sim.drive.rows import RowReader
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.assemble import start_state, system_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.scene.model import Scene
from ab_sim.sensing import Pickup
from ab_sim.stepping.fixed_step import ANGLE, DECK

NEAR = 1e-3
"""Share of samples that they are moved by: what is felt is smooth, and nearly linear."""


def of_readings(
    scene: Scene, run: Trajectory, keys: Sequence[RealKey], derivatives: np.ndarray
) -> np.ndarray:
    """Of all sensors, one after the other, shape (readings, keys, samples).

    Args:
        scene: what was run.
        run: every step of it, the start included.
        keys: of the scene.
        derivatives: of the run's channels from ANGLE on, shape (channels, keys, samples).
    """
    found: list[np.ndarray] = []
    for name, sensor in scene.pickups.items():
        exact = sensor.model_copy(
            update={"noise_density": 0.0, "resolution": 0.0, "range": math.inf}
        )
        axes = 2 if scene.deck is None else 3
        pickup = Pickup(exact, scene.solver.step, axes)
        each = np.empty((axes, len(keys), len(run)))
        for k, key in enumerate(keys):
            before, force = _force_change(scene, run, key, derivatives[:, k].T, name)
            pickup.reset(before)
            each[:, k, 0] = pickup.reading
            each[:, k, 1:] = pickup.process(1, force[1:]).T
        first = len(run.channels) - axes * (len(scene.pickups) - len(found))
        shown = run.samples[:, first : first + axes].T[:, None]
        each[np.broadcast_to(np.abs(shown) >= sensor.range, each.shape)] = 0.0
        found.append(each)
    return np.concatenate(found)


def _force_change(
    scene: Scene, run: Trajectory, key: RealKey, way: np.ndarray, sensor: str
) -> tuple[np.ndarray, np.ndarray]:
    """Of what a sensor feels as the deck hung before the start, shape (axes,), and at all samples.

    Args:
        way: the derivative of the samples from ANGLE on, shape (samples, channels).
    """
    kind = type(system_of(scene).deck_model)
    own = slice(DECK, DECK + len(kind.CHANNELS))

    def felt(samples: np.ndarray, there: Scene) -> np.ndarray:
        system = system_of(there)
        states = start_state(there, system)[layout_of(system).deck]
        rest = kind.at_rest(system.deck_model, states)
        return RowReader(there, system).felt(sensor, np.vstack((rest, samples)))

    change = way[:, own.start - ANGLE : own.stop - ANGLE]
    found = derivative_along(felt, run.samples[:, own], change, scene, key, NEAR).derivative
    return found[0], found[1:]

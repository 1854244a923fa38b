"""Conversion of a recorded state to the ``start`` section of a scene."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ab_sim.base.errors import InputError
from ab_sim.drive.orientation import tilt_of
from ab_sim.model.dynamics.deck_models.in_space import angular_velocity


def start_from(sample: Mapping[str, float], balls: int, tilts: bool) -> dict[str, Any]:
    """Return a scene's ``start`` section from a sample.

    A sample does not contain sticking of balls, the integrator of a motor's speed loop, or the
    state of sensor filters.

    Args:
        sample: value of each channel, see ``Trajectory``.
        balls: number of balls.
        tilts: whether the deck moves in space.

    Raises:
        InputError: a channel is missing or not finite; the message names it.
    """
    position, velocity = (["x", "y"], ["vx", "vy"])
    turn, turning = ["qw", "qx", "qy", "qz"], ["wx", "wy", "wz"]
    needed = ["angle", "speed", *position, *velocity]
    if tilts:
        position, velocity = [*position, "z"], [*velocity, "vz"]
        needed += ["z", "vz", *turn, *turning]
    needed += [f"ball_{i}_{what}" for i in range(balls) for what in ("angle", "rate")]
    if lacking := [name for name in needed if not math.isfinite(sample.get(name, math.nan))]:
        raise InputError(f"the sample lacks {', '.join(lacking)}")
    deck = {
        "position": [sample[name] for name in position],
        "velocity": [sample[name] for name in velocity],
    }
    if tilts:
        tilt = tilt_of(np.array([sample[name] for name in turn])).tolist()
        # The angular velocity is linear in the rates of the tilt angles: invert this map.
        rates_to_velocity = np.array(
            [angular_velocity(tuple(tilt), tuple(rate)) for rate in np.eye(3)]
        ).T
        rates = np.linalg.solve(rates_to_velocity, [sample[name] for name in turning])
        deck |= {"tilt": tilt, "tilt_rate": rates.tolist()}
    return {
        "angle": sample["angle"],
        "speed": sample["speed"],
        "ball_angles": [sample[f"ball_{i}_angle"] for i in range(balls)],
        "ball_rates": [sample[f"ball_{i}_rate"] for i in range(balls)],
        "deck": deck,
    }

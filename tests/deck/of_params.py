"""Conversion of the reference's parameters to a scene, the inverse of ``reference.of_scene``."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from ab_sim.model.spindle import Ramp, SpeedSchedule
from ab_sim.scene import Scene
from tests.deck.scenes import Changes, made
from tests.reference import DeckParams
from tests.reference.plant import Array

Vector = Sequence[float] | Array


def scene_of(
    p: DeckParams, places: Vector, rates: Vector, *, effects: Changes, step: float = 5e-4
) -> Scene:
    """Return a deck in motion with at most one race, whose spindle keeps its start speed.

    Parameters
    ----------
    p
        Parameters without friction, contact, motor and further masses.
    places
        X, Y, Z [m], alpha, beta, gamma, phi_i [rad].
    rates
        Time derivatives of ``places``.
    effects
        Effects in addition to drag, spindle acceleration and gravity.
    step
        Integration step [s].
    """
    (race,), disc = p.races or (None,), p.disc
    assert not disc.points and p.motor is None and p.contact is None
    turn = Rotation.from_euler("z", disc.angle).as_matrix()
    raw: Changes = {
        "rotor": {
            "mass": p.deck.mass + disc.mass,
            "eccentric_mass": disc.mass,
            "eccentricity": disc.eccentricity,
            "height": disc.height,
            "inertia": six(turn.T @ np.array(disc.inertia) @ turn),
        },
        "deck": {"center": [*p.deck.com], "inertia": six(np.array(p.deck.inertia))},
        "mounts": [
            {
                "position": [*mount.position],
                "stiffness": [*mount.stiffness],
                "damping": [*mount.damping],
                "turned": Rotation.from_matrix(mount.axes).as_rotvec().tolist(),
            }
            for mount in p.mounts
        ],
        "race": {"radius": 1.0},
        "balls": {"count": len(p.balls)},
        "effects": {"spindle_acceleration": {}, **effects},
        "start": {
            "speed": p.spindle.speed,
            "angle": p.spindle.angle + disc.angle,
            "ball_angles": [phi - disc.angle for phi in places[6:]],
            "ball_rates": [*rates[6:]],
            "deck": {
                "position": [*places[:3]],
                "tilt": [*places[3:6]],
                "velocity": [*rates[:3]],
                "tilt_rate": [*rates[3:6]],
            },
        },
        "spindle": {"max_speed": 1e3, "max_acceleration": 1e4},
        "solver": {"stepper": "rk8", "step": step},
        "duration": 1.0,
    }
    weight = np.array(p.gravity)
    if weight.any():
        raw["effects"]["gravity"] = {
            "acceleration": float(np.linalg.norm(weight)),
            "tilt": float(np.arctan2(np.hypot(*weight[:2]), -weight[2])),
            "direction": float(np.arctan2(weight[1], weight[0])),
        }
    if race is not None:
        raw["race"] = {"radius": race.radius, "height": race.height}
        raw["effects"]["viscous_drag"] = {"coefficient": race.drag / race.radius**2}
        raw["balls"]["mass"] = [ball.mass for ball in race.balls]
        if any(ball.radius for ball in race.balls):
            raw["balls"]["radius"] = [ball.radius for ball in race.balls]
    return made(raw)


def profile_of(p: DeckParams) -> SpeedSchedule:
    """Return the profile of the spindle's segments, each of constant acceleration."""
    segments, speed = [], p.spindle.speed
    for duration, acceleration in p.spindle.segments:
        segments.append((duration, Ramp(speed, acceleration)))
        speed += duration * acceleration
    return SpeedSchedule(segments, speed, start_angle=p.spindle.angle + p.disc.angle)


def six(inertia: Array) -> list[float]:
    """Return the entries xx, yy, zz, xy, xz, yz of an inertia matrix."""
    return [float(inertia[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]

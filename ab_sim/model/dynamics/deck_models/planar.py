"""Deck model ``planar`` from a scene: a deck that moves in the plane of the disc."""

import functools
import math
from typing import Any

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.model.dynamics.at_rest import Linearised, place_at_rest
from ab_sim.model.dynamics.registry import PLANAR, DeckFromScene, register_deck_model
from ab_sim.model.dynamics.system import (
    MASS,
    System,
    has_gravity,
)
from ab_sim.model.equations.motion import DeckMotion
from ab_sim.model.equations.planar import Planar
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene.model import Scene

_DIRECTIONS = np.array([[math.cos(a), math.sin(a)] for a in math.pi * np.arange(8) / 8]).T
"""Directions in which damping and stiffness are computed: unit vectors, shape (2, 8)."""
_AWAY, _PASSING = np.array([[1.0], [-1.0], [0.0]]), np.array([[0.0], [0.0], [1.0]])
"""Test displacements as multiples of a direction: outwards, inwards, and zero with a velocity."""


def _deck_model_of(scene: Scene, effects: tuple[object, ...]) -> Planar:
    """Return the constants of the deck model of a scene with the given effects."""
    eccentricity = scene.rotor.eccentricity
    sag_x, sag_y = _sag(scene.total_mass, effects) if has_gravity(effects) else (0.0, 0.0)
    return Planar(
        total_mass=scene.total_mass,
        unbalance=scene.eccentric_mass * eccentricity,
        eccentricity=eccentricity,
        sag_x=sag_x,
        sag_y=sag_y,
    )


def _start_of(scene: Scene, system: System) -> np.ndarray:
    """Return the deck's states at t = 0 in the order of ``Planar.STATE_NAMES``, shape (4,).

    The deck is at rest in space by default: its inertial velocity, given on the rotating axes, is
    zero at any spindle speed.
    """
    start, psi = scene.start.deck, scene.start.angle
    c, s = math.cos(psi), math.sin(psi)
    pairs = start.position or (0.0, 0.0), start.velocity or (0.0, 0.0)
    # Not by BLAS, because its kernels round differently.
    return np.array([number for x, y in pairs for number in (c * x + s * y, c * y - s * x)])


def rates_of(system: System, top_speed: float) -> dict[str, Any]:
    """Return the suspension's fastest eigenvalue [1/s] by name; a column for a system with columns.

    Parameters
    ----------
    system
        The system.
    top_speed
        Largest spindle speed [rad/s]; on rotating axes, the deck's whirl is faster by this speed.
    """
    mass = system.deck_model.total_mass - system.balls[:, MASS].sum(axis=0)
    damping, stiffness = _resistances(system.effects, system.deck_model)
    mean, apart = damping / (2.0 * mass), stiffness / mass
    half = np.sqrt(mean**2 - apart + 0j)
    poles = np.concatenate([-mean + half, -mean - half])
    turning = poles + 1j * np.where(poles.imag >= 0, top_speed, -top_speed)
    places = np.abs(turning).argmax(axis=0, keepdims=True)
    fastest = np.take_along_axis(turning, places, axis=0)[0]
    name = f"the deck's whirl at {top_speed:.6g} rad/s"
    return {name: complex(fastest[0]) if len(fastest) == 1 else fastest}


def _yields_of(system: System) -> list[np.ndarray]:
    """Return accelerations of the race at each ball per force on the race at each ball [1/kg].

    Accelerations and forces are those along the race.

    Returns
    -------
    list[np.ndarray]
        One matrix, shape (balls, balls), for all balls at one angle; it is the same for any angle.
    """
    yields = 1.0 / np.asarray(system.deck_model.total_mass)
    return [yields[..., None, None] * np.ones((len(system.balls),) * 2)]


def linearised(system: System) -> Linearised:
    """Return the linear equations of small motions x, y about the deck's position at rest.

    There are no gyroscopic terms, because the deck does not tilt.
    """
    body, effects = system.deck_model, system.effects
    rest = np.array([body.sag_x, body.sag_y, 0.0, 0.0])
    far = max(float(np.hypot(body.sag_x, body.sag_y)), 1e-6)

    def force(moved: np.ndarray) -> np.ndarray:
        deck = DeckMotion(*(float(x) for x in rest + moved))
        return np.array(_force(effects, deck), float)

    def against(way: np.ndarray) -> np.ndarray:
        # Differences at five points are exact for linear and cubic springs, whatever the sag.
        near, wide = (force(-x * way) - force(x * way) for x in (far, 2.0 * far))
        return (8.0 * near - wide) / (12.0 * far)

    ways = np.array([against(way) for way in np.eye(4)]).T
    return Linearised(
        mass=body.total_mass * np.eye(2),
        damping=ways[:, 2:],
        gyroscopic=np.zeros((2, 2)),
        stiffness=ways[:, :2],
        rest=(body.sag_x, body.sag_y),
        coordinates=("x", "y"),
        units=("m", "m"),
        across=((0, 1),),
    )


@functools.lru_cache(maxsize=64)
def _sag(mass: float, effects: tuple[object, ...]) -> tuple[float, float]:
    """Return the sag under gravity, from the suspension's unloaded position [m]."""
    weight = mass * np.array(over_effects(effects, "gravity", (0.0, 0.0)))

    def unbalanced(place: np.ndarray) -> np.ndarray:
        deck = DeckMotion(float(place[0]), float(place[1]), 0.0, 0.0)
        force = np.array(_force(effects, deck), float)
        return np.asarray((force + weight) / np.hypot(*weight))

    rest = place_at_rest(unbalanced, lambda place: _stored(effects, place), weight)
    if rest is None:
        raise SceneError(
            "effects.gravity: no place was found where the suspension holds the deck's weight; "
            "give it stiffness in every direction"
        )
    return float(rest[0]), float(rest[1])


def _stored(effects: tuple[object, ...], place: np.ndarray) -> float:
    """Return the energy in the suspension [J] at a displacement [m] from the unloaded position."""
    deck = DeckMotion(float(place[0]), float(place[1]), 0.0, 0.0)
    stored = over_effects(effects, "deck_energy", 0.0, deck)
    return float(stored + over_effects(effects, "space_energy", 0.0, deck))


def _resistances(effects: tuple[object, ...], body: Planar) -> tuple[np.ndarray, np.ndarray]:
    """Return damping [N s/m] and stiffness [N/m] of the suspension, shape (directions, runs)."""
    # Far enough from rest for a cubic spring to count: the sag, or 10 e.
    hangs = math.hypot(body.sag_x, body.sag_y)
    far = np.atleast_1d(np.maximum(np.maximum(10.0 * body.eccentricity, hangs), 1e-9))
    c, s = _DIRECTIONS[:, :, None]
    places = far * (_AWAY * _DIRECTIONS[:, None])[..., None]
    passing = np.broadcast_to((_PASSING * _DIRECTIONS[:, None])[..., None], places.shape)
    moved = np.concatenate([places, passing])
    try:
        f1, f2 = _force(effects, DeckMotion(*moved))
    except (TypeError, ValueError):
        # An effect that branches on its arguments takes floats only: call it for each point.
        forces = [_force(effects, DeckMotion(*one)) for one in moved.reshape(4, -1).T.tolist()]
        f1, f2 = np.array(forces).T.reshape(2, *moved.shape[1:])
    against = -(c * f1 + s * f2)
    shape = np.broadcast_shapes(against.shape, moved.shape[1:])
    there, back, passing = np.broadcast_to(against, shape)
    return passing, (there - back) / (2.0 * far)


def _force(effects: tuple[object, ...], deck: DeckMotion) -> tuple[Any, Any]:
    """Return the suspension's force [N] at one or many deck states."""
    f = over_effects(effects, "deck_force", (0.0, 0.0), deck)
    g = over_effects(effects, "space_force", (0.0, 0.0), deck)
    return f[0] + g[0], f[1] + g[1]


register_deck_model(
    PLANAR,
    Planar,
    DeckFromScene(
        make=_deck_model_of,
        start=_start_of,
        yields=_yields_of,
        rates=rates_of,
        linearised=linearised,
    ),
)

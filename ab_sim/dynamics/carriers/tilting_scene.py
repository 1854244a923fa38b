"""A deck that tilts, from a scene."""

import math
from typing import Final

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from ab_sim.dynamics.carriers.tilting import MOUNT_WIDTH, Tilting
from ab_sim.dynamics.system import (
    MASS,
    RACE_HEIGHT,
    RACE_RADIUS,
    System,
    mount_energy,
    mount_stiffening,
    rotor_moment,
    weight,
)
from ab_sim.errors import SceneError
from ab_sim.scene.deck import inertia_matrix
from ab_sim.scene.model import Scene

EULER: Final = "ZXY"
"""gamma, alpha, beta, about the axes as they have turned."""


def carrier_of(scene: Scene, effects: tuple[object, ...]) -> Tilting:
    """Its constants."""
    deck, rotor = scene.deck, scene.rotor
    assert deck is not None and rotor.inertia is not None
    mass = scene.total_mass - scene.balls.total_mass - scene.eccentric_mass
    center = np.array(deck.center)
    about = inertia_matrix(deck.inertia) + mass * _away(center)
    own = inertia_matrix(rotor.inertia)
    # A motor's own rotor is a flywheel that turns about the shaft, and nothing else.
    own[2, 2] += rotor_moment(effects)
    place = np.array([rotor.eccentricity, 0.0, rotor.height])
    moments = 0.5 * np.trace(own) * np.eye(3) - own
    moments += scene.eccentric_mass * np.outer(place, place)
    return Tilting(
        total_mass=scene.total_mass,
        unbalance=scene.eccentric_mass * rotor.eccentricity,
        eccentricity=rotor.eccentricity,
        rotor_lift=scene.eccentric_mass * rotor.height,
        deck_first=_numbers(mass * center),
        deck_inertia=_six(about),
        rotor_second=_six(moments),
        mounts=_mounts(scene),
        gravity=_numbers(np.array(weight(effects))),
    )


def start_of(scene: Scene, system: System) -> np.ndarray:
    """Its states at t = 0, shape (13,).

    Raises:
        SceneError: it is to start where it hangs at rest, and there is no such place.
    """
    start = scene.start.deck
    place, turn = np.zeros(3), Rotation.identity()
    if any(system.carrier.gravity) and (start.position is None or start.tilt is None):
        hangs = _at_rest(system)
        place, turn = hangs[:3], Rotation.from_rotvec(hangs[3:])
    if start.position is not None:
        place = np.array(start.position)
    tilt = start.tilt
    if tilt is None:
        gamma, alpha, beta = (float(angle) for angle in turn.as_euler(EULER))
        tilt = alpha, beta, gamma
    else:
        alpha, beta, gamma = tilt
        turn = Rotation.from_euler(EULER, (gamma, alpha, beta))
    rates = angular_velocity(tilt, start.tilt_rate or (0.0, 0.0, 0.0))
    x, y, z, w = turn.as_quat()
    return np.array([*place, w, x, y, z, *(start.velocity or (0.0, 0.0, 0.0)), *rates])


def angular_velocity(tilt: tuple[float, ...], rate: tuple[float, ...]) -> np.ndarray:
    """On deck axes [rad/s], from alpha, beta, gamma [rad] and their rates [rad/s]."""
    (alpha, beta, _), (alpha_rate, beta_rate, gamma_rate) = tilt, rate
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return np.array(
        [
            alpha_rate * cb - gamma_rate * ca * sb,
            beta_rate + gamma_rate * sa,
            alpha_rate * sb + gamma_rate * ca * cb,
        ]
    )


def rates_of(system: System, top_speed: float) -> dict[str, complex]:
    """The fastest eigenvalue [1/s] of the deck on its mounts, gyroscopic moments included."""
    mass, damping, stiffness = suspended(system, top_speed)
    size = len(mass)
    inverse = np.linalg.inv(mass)
    first = np.block(
        [[np.zeros((size, size)), np.eye(size)], [-inverse @ stiffness, -inverse @ damping]]
    )
    fastest = max(np.linalg.eigvals(first), key=abs)
    return {"the deck's motion on its mounts": complex(fastest)} if abs(fastest) > 0 else {}


def lightness_of(system: System) -> float:
    """Acceleration of the race at a ball per force on it there, along the race [1/kg]."""
    mass, _, _ = suspended(system, 0.0)
    inverse = np.linalg.inv(mass)
    most = 0.0
    for radius, height in system.balls[:, [RACE_RADIUS, RACE_HEIGHT]]:
        for along in np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False):
            c, s = math.cos(along), math.sin(along)
            way = np.array([-s, c, 0.0])
            reach = np.concatenate([way, np.cross([radius * c, radius * s, height], way)])
            most = max(most, float(reach @ inverse @ reach))
    return most


def suspended(system: System, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, damping with gyroscopic moments, and stiffness about rest, each of shape (6, 6).

    Coordinates: X, Y, Z [m] and the turn about x, y, z [rad]. Rotor and balls are averaged over one
    turn; the balls spread evenly, and turn with the rotor.

    Args:
        system: the System.
        speed: of the spindle [rad/s].
    """
    deck, balls = system.carrier, system.balls
    xx, yy, zz, _, _, _ = deck.rotor_second
    ring, lifted = 0.5 * (xx + yy), balls[:, MASS] * balls[:, RACE_HEIGHT]
    ring += 0.5 * float((balls[:, MASS] * balls[:, RACE_RADIUS] ** 2).sum())
    tall = zz + float((lifted * balls[:, RACE_HEIGHT]).sum())
    inertia = np.diag([ring + tall, ring + tall, 2.0 * ring]) + _matrix(deck.deck_inertia)
    first = np.array(deck.deck_first) + [0.0, 0.0, deck.rotor_lift + float(lifted.sum())]
    mass, damping, stiffness = (np.zeros((6, 6)) for _ in range(3))
    mass[:3, :3] = deck.total_mass * np.eye(3)
    mass[:3, 3:] = -_cross(first)
    mass[3:, :3] = _cross(first)
    mass[3:, 3:] = inertia
    spin = 2.0 * ring * speed
    damping[3, 4], damping[4, 3] = spin, -spin
    for mount in deck.mounts:
        axes = mount[9:].reshape(3, 3)
        moved = axes @ np.hstack([np.eye(3), -_cross(mount[:3])])
        stiffness += moved.T @ np.diag(mount[3:6]) @ moved
        damping += moved.T @ np.diag(mount[6:9]) @ moved
    return mass, damping, stiffness


def _at_rest(system: System) -> np.ndarray:
    """Where the deck hangs: X, Y, Z of C [m], and its turn as a rotation vector [rad]."""
    deck, effects = system.carrier, system.effects
    mass, lifted = deck.total_mass, system.balls[:, MASS] * system.balls[:, RACE_HEIGHT]
    first = np.array(deck.deck_first) + [0.0, 0.0, deck.rotor_lift + float(lifted.sum())]
    pull, size = np.array(deck.gravity), mass * float(np.linalg.norm(deck.gravity))

    def unbalanced(place: np.ndarray) -> np.ndarray:
        turn = Rotation.from_rotvec(place[3:]).as_matrix()
        force, moment = mass * pull, np.cross(turn @ first, pull)
        for mount in deck.mounts:
            axes = mount[9:].reshape(3, 3)
            moved = axes @ (place[:3] + turn @ mount[:3] - mount[:3])
            held = mount[3:6] + mount_stiffening(effects, float(moved @ moved))
            own = -axes.T @ (held * moved)
            force, moment = force + own, moment + np.cross(turn @ mount[:3], own)
        return np.concatenate([force, moment / 0.1]) / size

    # Down the weight until the mounts have stored as much as it has done work.
    down, reach = pull / np.linalg.norm(pull), 1e-9
    while _stored(system, reach * down) < reach * size and reach < 1e6:
        reach *= 2.0
    found = root(unbalanced, np.append(0.5 * reach * down, np.zeros(3)), tol=1e-15)
    if np.abs(unbalanced(found.x)).max() > 1e-9:
        raise SceneError(
            "effects.gravity: no place was found where the mounts hold the deck's weight; give "
            "them stiffness in every direction, or say where the deck starts (start.deck)"
        )
    return np.asarray(found.x)


def _stored(system: System, moved: np.ndarray) -> float:
    """In the mounts [J], where the deck is moved and not turned."""
    energy = 0.0
    for mount in system.carrier.mounts:
        own = mount[9:].reshape(3, 3) @ moved
        energy += 0.5 * float(mount[3:6] @ own**2)
        energy += mount_energy(system.effects, float(own @ own))
    return energy


def _mounts(scene: Scene) -> np.ndarray:
    rows = np.empty((len(scene.mounts), MOUNT_WIDTH))
    for row, mount in zip(rows, scene.mounts, strict=True):
        # Rows of the matrix that turns the ground's axes into the mount's.
        axes = Rotation.from_rotvec(mount.turned).as_matrix().T
        stiffness, damping = np.broadcast_to(mount.stiffness, 3), np.broadcast_to(mount.damping, 3)
        row[:] = np.concatenate([mount.position, stiffness, damping, axes.ravel()])
    return rows


def _away(place: np.ndarray) -> np.ndarray:
    """Inertia of a unit mass at a place about the origin."""
    return np.asarray(place @ place * np.eye(3) - np.outer(place, place))


def _cross(vector: np.ndarray) -> np.ndarray:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _matrix(six: tuple[float, ...]) -> np.ndarray:
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _six(matrix: np.ndarray) -> tuple[float, float, float, float, float, float]:
    xx, yy, zz = (float(x) for x in np.diag(matrix))
    return xx, yy, zz, float(matrix[0, 1]), float(matrix[0, 2]), float(matrix[1, 2])


def _numbers(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(x) for x in vector)
    return x, y, z

"""Deck model ``in_space`` from a scene: a deck that moves and tilts on its mounts."""

import contextlib
import math
from typing import TYPE_CHECKING, Final

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.model.dynamics.at_rest import Linearised, place_at_rest
from ab_sim.model.dynamics.registry import IN_SPACE, DeckFromScene, register_deck_model
from ab_sim.model.dynamics.system import (
    HEIGHT,
    MASS,
    RACE_RADIUS,
    RADIUS,
    System,
    has_spin,
    has_stiffening,
    rotor_moment,
)
from ab_sim.model.equations.in_space import InSpace, symmetric
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.mounts import MOUNT_WIDTH, mount_energy, turn_of
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import inertia_matrix

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_EULER: Final = "ZXY"
"""Order of the deck's rotations: gamma about z, then alpha about the turned x, beta about y."""


def _deck_model_of(scene: Scene, effects: tuple[object, ...]) -> InSpace:
    """Return the constants of the deck model of a scene with the given effects."""
    deck, rotor = scene.deck, scene.rotor
    assert deck is not None and rotor.inertia is not None
    mass = scene.total_mass - scene.balls.total_mass - scene.eccentric_mass
    center = np.array(deck.center)
    about = inertia_matrix(deck.inertia) + mass * _away(center)
    inertia = inertia_matrix(rotor.inertia)
    # A motor's rotor is modelled as a flywheel with inertia about the shaft only.
    inertia[2, 2] += rotor_moment(effects)
    place = np.array([rotor.eccentricity, 0.0, rotor.height])
    moments = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    moments += scene.eccentric_mass * np.outer(place, place)
    return InSpace(
        total_mass=scene.total_mass,
        unbalance=scene.eccentric_mass * rotor.eccentricity,
        eccentricity=rotor.eccentricity,
        rotor_first_z=scene.eccentric_mass * rotor.height,
        deck_first=_numbers(mass * center),
        deck_inertia=_six(about),
        rotor_second=_six(moments),
        mounts=_mounts(scene),
        gravity=_numbers(np.array(over_effects(effects, "weight", (0.0, 0.0, 0.0)))),
    )


def _rotation() -> "type[Rotation]":
    """Return SciPy's class ``Rotation``.

    The import takes as long as a run, and decks in the plane do not need it.
    """
    from scipy.spatial.transform import Rotation

    return Rotation


def _start_of(scene: Scene, system: System) -> np.ndarray:
    """Return the deck's states at t = 0 in the order of ``InSpace.STATE_NAMES``, shape (13,).

    Raises
    ------
    SceneError
        The deck is to start at rest, and there is no position at rest.
    """
    start = scene.start.deck
    place, turn = np.zeros(3), _rotation().identity()
    if any(system.deck_model.gravity) and (start.position is None or start.tilt is None):
        hangs = _at_rest(system)
        place, turn = hangs[:3], _rotation().from_rotvec(hangs[3:])
    if start.position is not None:
        place = np.array(start.position)
    tilt = start.tilt
    if tilt is None:
        gamma, alpha, beta = (float(angle) for angle in turn.as_euler(_EULER))
        tilt = alpha, beta, gamma
    else:
        alpha, beta, gamma = tilt
        turn = _rotation().from_euler(_EULER, (gamma, alpha, beta))
    rates = angular_velocity(tilt, start.tilt_rate or (0.0, 0.0, 0.0))
    x, y, z, w = turn.as_quat()
    return np.array([*place, w, x, y, z, *(start.velocity or (0.0, 0.0, 0.0)), *rates])


def angular_velocity(tilt: tuple[float, ...], rate: tuple[float, ...]) -> np.ndarray:
    """Return the angular velocity of a deck on deck axes [rad/s], shape (3,).

    Parameters
    ----------
    tilt
        Angles alpha, beta, gamma of the deck [rad].
    rate
        Rates of change of these angles [rad/s].
    """
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
    """Return the eigenvalue of largest modulus [1/s] of the deck on its mounts.

    Parameters
    ----------
    system
        The system.
    top_speed
        Spindle speed at which gyroscopic moments are taken [rad/s].

    Returns
    -------
    dict[str, complex]
        The eigenvalue, with its name in messages as the key; empty if it is 0.
    """
    matrix = linearised(_weightless(_hardened(system))).matrix(top_speed)
    fastest = max(np.linalg.eigvals(matrix), key=abs)
    return {"the deck's motion on its mounts": complex(fastest)} if abs(fastest) > 0 else {}


def _yields_of(system: System) -> list[np.ndarray]:
    """Return accelerations of the race at each ball per force on the race at each ball [1/kg].

    Accelerations and forces are those along the race.

    Returns
    -------
    list[np.ndarray]
        One matrix, shape (balls, balls), for each of 16 angles at which all balls are placed.
    """
    weights, yields = system.balls[:, MASS], []
    empty = system.deck_model._replace(
        total_mass=system.deck_model.total_mass - float(weights.sum())
    )
    bare = linearised(_weightless(system._replace(deck_model=empty, balls=system.balls[:0]))).mass
    for along in np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False):
        c, s = math.cos(along), math.sin(along)
        mass, ways = bare.copy(), []
        for m, radius, height in system.balls[:, [MASS, RACE_RADIUS, HEIGHT]]:
            moves = np.hstack([np.eye(3), -_cross(np.array([radius * c, radius * s, height]))])
            mass += m * moves.T @ moves
            ways.append(np.array([-s, c, 0.0]) @ moves)
        yields.append(np.array(ways) @ np.linalg.solve(mass, np.transpose(ways)))
    return yields


def linearised(system: System) -> Linearised:
    """Return the linear equations of small motions about the deck's position at rest.

    Coordinates are X, Y, Z on the ground's axes, and turns about the deck's x, y, z. The equations
    are those of ``equations.in_space`` for a symmetric rotor, whose first moment across the spindle
    axis is zero (V = 0).

    Raises
    ------
    SceneError
        There is no position at rest.
    """
    rest = _at_rest(system) if any(system.deck_model.gravity) else np.zeros(6)
    deck, effects = system.deck_model, system.effects
    turn = _rotation().from_rotvec(rest[3:]).as_matrix()
    ring, tall, first = _averaged(system)
    gravity = turn.T @ np.array(deck.gravity)
    mass, damping, gyroscopic, stiffness = (np.zeros((6, 6)) for _ in range(4))
    mass[:3, :3] = deck.total_mass * np.eye(3)
    mass[:3, 3:] = -turn @ _cross(first)
    mass[3:, :3] = mass[:3, 3:].T
    mass[3:, 3:] = symmetric(deck.deck_inertia) + np.diag([ring + tall, ring + tall, 2.0 * ring])
    gyroscopic[3, 4], gyroscopic[4, 3] = 2.0 * ring, -2.0 * ring
    stiffness[3:, 3:] = _stiffness_against_turning(first, gravity)
    for mount in deck.mounts:
        axes, place = mount[9:].reshape(3, 3), mount[:3]
        moved = axes @ (rest[:3] + turn @ place - place)
        change = axes @ np.hstack([np.eye(3), -turn @ _cross(place)])
        stiffening, slope = _stiffening(effects, float(moved @ moved))
        held = mount[3:6] + stiffening
        stiffness_here = np.diag(held) + 2.0 * slope * np.outer(moved, moved)
        stiffness += change.T @ stiffness_here @ change
        stiffness[3:, 3:] += _stiffness_against_turning(place, -(axes @ turn).T @ (held * moved))
        damping += change.T @ np.diag(mount[6:9]) @ change
    return Linearised(
        mass, damping, gyroscopic, stiffness,
        rest=tuple(float(x) for x in rest),
        coordinates=("X", "Y", "Z", "tilt about x", "tilt about y", "turn about z"),
        units=("m", "m", "m", "rad", "rad", "rad"),
        across=((0, 1), (3, 4)),
    )  # fmt: skip


def _weightless(system: System) -> System:
    """Return the system without gravity, so that its mounts are relaxed at rest."""
    return system._replace(deck_model=system.deck_model._replace(gravity=(0.0, 0.0, 0.0)))


def _hardened(system: System) -> System:
    """Return the system with the stiffness of hardening mounts at the sag, or at 10 e if larger."""
    deck, effects = system.deck_model, system.effects
    if not has_stiffening(effects):
        return system
    place, turn = np.zeros(3), np.eye(3)
    # A deck without a position at rest is allowed: it falls.
    with contextlib.suppress(SceneError):
        if any(deck.gravity):
            rest = _at_rest(system)
            place, turn = rest[:3], _rotation().from_rotvec(rest[3:]).as_matrix()
    mounts = deck.mounts.copy()
    for mount in mounts:
        moved = place + turn @ mount[:3] - mount[:3]
        far = max(float(np.linalg.norm(moved)), 10.0 * deck.eccentricity, 1e-9)
        mount[3:6] += _stiffness_gained(effects, far**2)
    return system._replace(deck_model=deck._replace(mounts=mounts))


def _averaged(system: System) -> tuple[float, float, np.ndarray]:
    """Return second moments of rotor and balls averaged over a turn, and the first moment.

    Returns
    -------
    tuple[float, float, np.ndarray]
        Second moments across and along the shaft [kg m^2], and the first moment of all moving
        masses [kg m], shape (3,).
    """
    deck = system.deck_model
    xx, yy, tall, _, _, _ = deck.rotor_second
    ring, lift = 0.5 * (xx + yy), deck.rotor_first_z
    for i, (m, radius, height) in enumerate(system.balls[:, [MASS, RACE_RADIUS, HEIGHT]]):
        ring += 0.5 * m * radius**2
        tall += m * height**2
        lift += m * height
        if has_spin(system.effects):
            ball = Ball(*system.balls[i, [MASS, RADIUS]].tolist())
            inertia = 0.5 * over_effects(system.effects, "ball_inertia", 0.0, ball) * ball.radius**2
            ring, tall = ring + inertia, tall + inertia
    return ring, tall, np.array(deck.deck_first) + [0.0, 0.0, lift]


def _stiffness_against_turning(place: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the stiffness against turns of the deck due to a constant force [N m/rad].

    Place p [m] and force f [N] are on deck axes. A turn by phi moves the place by phi x p +
    phi x (phi x p) / 2, and -f . (phi x (phi x p)) / 2 is the second-order term of the energy. The
    result has the shape (3, 3).
    """
    outer = np.outer(place, force)
    return np.asarray(place @ force * np.eye(3) - 0.5 * (outer + outer.T))


def _stiffening(effects: tuple[object, ...], square: float) -> tuple[float, float]:
    """Return the stiffness [N/m] that effects add to a mount, and its derivative by ``square``.

    ``square`` is the square of the mount's displacement [m^2].
    """
    step = 1e-3 * square
    slope = 0.0
    if step > 0.0:
        slope = (
            _stiffness_gained(effects, square + step) - _stiffness_gained(effects, square - step)
        ) / (2.0 * step)
    return _stiffness_gained(effects, square), slope


def _stiffness_gained(effects: tuple[object, ...], square: float) -> float:
    """Return the stiffness [N/m] that effects add to a mount; ``square``: displacement^2 [m^2]."""
    return float(over_effects(effects, "mount_stiffening", 0.0, square))


def _at_rest(system: System) -> np.ndarray:
    """Return the position at rest: X, Y, Z of C [m], and a rotation vector [rad]."""
    deck, effects = system.deck_model, system.effects
    mass, (_, _, first) = deck.total_mass, _averaged(system)
    pull, size = np.array(deck.gravity), mass * float(np.linalg.norm(deck.gravity))

    def unbalanced(place: np.ndarray) -> np.ndarray:
        turn = _rotation().from_rotvec(place[3:]).as_matrix()
        force, moment = mass * pull, np.cross(turn @ first, pull)
        for mount in deck.mounts:
            axes = mount[9:].reshape(3, 3)
            moved = axes @ (place[:3] + turn @ mount[:3] - mount[:3])
            held = mount[3:6] + _stiffness_gained(effects, float(moved @ moved))
            pull_here = -axes.T @ (held * moved)
            force, moment = force + pull_here, moment + np.cross(turn @ mount[:3], pull_here)
        # A length of 0.1 m makes moments comparable to forces; at the solution both vanish.
        return np.concatenate([force, moment / 0.1]) / size

    rest = place_at_rest(unbalanced, lambda moved: _stored(system, moved), mass * pull, 3)
    if rest is None:
        raise SceneError(
            "effects.gravity: no place was found where the mounts hold the deck's weight; give "
            "them stiffness in every direction, or say where the deck starts (start.deck)"
        )
    return rest


def _stored(system: System, moved: np.ndarray) -> float:
    """Return the energy in the mounts [J] for a displacement of the deck without a turn."""
    state = [*moved.tolist(), 1.0, *[0.0] * 9]
    return float(mount_energy(system.deck_model, system.effects, turn_of(state[3:7]), state))


def _mounts(scene: Scene) -> np.ndarray:
    """Return ``InSpace.mounts`` of a scene."""
    rows = np.empty((len(scene.mounts), MOUNT_WIDTH))
    for row, mount in zip(rows, scene.mounts, strict=True):
        # Rows of the matrix from the ground's axes to the mount's.
        axes = _rotation().from_rotvec(mount.turned).as_matrix().T
        stiffness, damping = np.broadcast_to(mount.stiffness, 3), np.broadcast_to(mount.damping, 3)
        row[:] = np.concatenate([mount.position, stiffness, damping, axes.ravel()])
    return rows


def _away(place: np.ndarray) -> np.ndarray:
    """Return the inertia matrix of a unit mass at a place [m] about the origin [m^2]."""
    return np.asarray(place @ place * np.eye(3) - np.outer(place, place))


def _cross(vector: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product with a vector from the left, shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _six(matrix: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """Return the elements xx, yy, zz, xy, xz, yz of a symmetric matrix."""
    xx, yy, zz = (float(x) for x in np.diag(matrix))
    return xx, yy, zz, float(matrix[0, 1]), float(matrix[0, 2]), float(matrix[1, 2])


def _numbers(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(x) for x in vector)
    return x, y, z


register_deck_model(
    IN_SPACE,
    InSpace,
    DeckFromScene(
        make=_deck_model_of,
        start=_start_of,
        yields=_yields_of,
        rates=rates_of,
        linearised=linearised,
    ),
)

"""Poses and velocities of a drive's deck, spindle and balls: read and set."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, SceneError
from ab_sim.drive.drive import Drive
from ab_sim.drive.observation import Observation, Snapshot
from ab_sim.drive.snapshot_file import check_bounds
from ab_sim.drive.trajectory import matrix_of
from ab_sim.model.dynamics.registry import require_built_in
from ab_sim.model.dynamics.system import DIRECTION, TURNS
from ab_sim.model.equations.neighbours import reduced
from ab_sim.scene.model import Scene
from ab_sim.scene.sensors import DECK, SPINDLE, ball_frame

_OFF_RACE = 0.01
"""Largest distance from the race at which a ball's new position is accepted, in race radii."""
Vector = Sequence[float]


class BodyPose(NamedTuple):
    """Pose of a body in the frame of the housing."""

    position: Vector
    """Position [m]."""
    turn: Vector
    """Quaternion (w, x, y, z) from the body's axes to those of the housing."""


class BodyRates(NamedTuple):
    """Velocity or acceleration of a body in the frame of the housing."""

    linear: Vector
    """Velocity [m/s] or acceleration [m/s^2] of the body's position."""
    angular: Vector
    """Angular velocity [rad/s] or angular acceleration [rad/s^2] of the body."""


UNKNOWN = BodyRates((math.nan,) * 3, (math.nan,) * 3)


class BodyMotion(NamedTuple):
    """Motion of a body in the frame of the housing."""

    pose: BodyPose
    velocity: BodyRates
    acceleration: BodyRates
    """Acceleration; NaN for all bodies but the deck."""


def body_names(scene: Scene) -> list[str]:
    """Return the names of a scene's bodies, which are those of their frames."""
    return [DECK, SPINDLE, *map(ball_frame, range(scene.balls.count))]


def motion_of(name: str, scene: Scene, now: Observation) -> BodyMotion:
    """Return the motion of a body; as in the URDF, a runout of the race is left out.

    Parameters
    ----------
    name
        Name of the body, see ``body_names``.
    scene
        Scene of the drive.
    now
        Observation of the drive.
    """
    place, velocity, acceleration = (
        np.pad(vector, (0, 3 - len(vector)))
        for vector in (now.position, now.velocity, now.acceleration)
    )
    if name == DECK:
        return BodyMotion(
            BodyPose(place.tolist(), now.turn.tolist()),
            BodyRates(velocity.tolist(), now.angular_velocity.tolist()),
            BodyRates(acceleration.tolist(), now.angular_acceleration.tolist()),
        )
    angle, rate, lever, along = now.psi, now.omega, np.zeros(3), np.zeros(3)
    axes, spin = matrix_of(now.turn), now.angular_velocity
    if name != SPINDLE:
        ball = _ball(name, scene)
        angle, rate = angle + float(now.theta[ball]), rate + float(now.theta_rate[ball])
        lever = axes @ _on_race(scene, ball, angle)
        along = scene.race.radius * rate * (axes @ [-math.sin(angle), math.cos(angle), 0.0])
    w, x, y, z = now.turn.tolist()
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    turn = c * w - s * z, c * x + s * y, c * y - s * x, c * z + s * w
    return BodyMotion(
        BodyPose((place + lever).tolist(), turn),
        BodyRates(
            (velocity + np.cross(spin, lever) + along).tolist(),
            (spin + rate * axes[:, 2]).tolist(),
        ),
        UNKNOWN,
    )


def moved(drive: Drive, name: str, pose: BodyPose | None, velocity: BodyRates | None) -> Snapshot:
    """Return the snapshot of a drive with another state of its deck or of a ball.

    Parameters
    ----------
    drive
        Drive, which does not change.
    name
        Body to move.
    pose
        New pose; only the position along the race is used for a ball. None: unchanged.
    velocity
        New velocity; only the speed along the race is used for a ball. None: unchanged.

    Raises
    ------
    InputError
        The pose or velocity is impossible; the message states the reason.
    SceneError
        The state of the body cannot be set in this scene.
    """
    numbers = [*(x for part in pose or () for x in part), *(x for v in velocity or () for x in v)]
    if not np.all(np.isfinite(numbers)):
        raise InputError(f"{name}: pose and velocity must be finite numbers")
    kept = drive.snapshot()
    # The stepper's memory refers to the old state.
    kept = kept._replace(memory=np.empty(0))
    if name == DECK:
        require_built_in(drive.scene, "another state of the deck")
        _move_deck(drive, kept, pose, velocity)
    elif name == SPINDLE:
        raise SceneError("spindle: its state cannot be set; command a speed on spindle/command")
    else:
        _move_ball(drive, kept, name, pose, velocity)
    try:
        check_bounds(kept, drive.scene)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from error
    return kept


def _move_deck(
    drive: Drive, kept: Snapshot, pose: BodyPose | None, velocity: BodyRates | None
) -> None:
    """Write another state of the deck into a snapshot, in place; see ``moved``."""
    state, now = kept.state[drive.layout.deck], drive.observe()
    turn = now.turn
    if pose is not None:
        turn = np.array(pose.turn)
        length = math.sqrt(float(turn @ turn))
        if not abs(length - 1.0) < 1e-3:
            raise InputError(f"deck: orientation: the quaternion's norm is {length:g}; must be 1")
        turn = turn / length
    if type(drive.system.deck_model).AXES == 3:
        if pose is not None:
            state[:7] = *pose.position, *turn
        if velocity is not None:
            state[7:] = *velocity.linear, *(matrix_of(turn).T @ velocity.angular)
        return
    if abs(turn[0]) < 1.0 - 1e-12:
        raise InputError("deck: it moves in a plane; its orientation must be that of the housing")
    c, s = math.cos(now.psi), math.sin(now.psi)
    for first, vector in ((0, pose and pose.position), (2, velocity and velocity.linear)):
        if vector is not None:
            x, y, z = vector
            if z != 0.0:
                raise InputError(f"deck: it moves in a plane; z = {z:g} must be 0")
            state[first : first + 2] = c * x + s * y, c * y - s * x
    if velocity is not None and any(velocity.angular):
        raise InputError("deck: it moves in a plane; its angular velocity must be 0")


def _move_ball(
    drive: Drive, kept: Snapshot, name: str, pose: BodyPose | None, velocity: BodyRates | None
) -> None:
    """Write another state of a ball into a snapshot, in place; see ``moved``."""
    scene, layout, now = drive.scene, drive.layout, drive.observe()
    if "ball_contact" in scene.effects:
        raise SceneError(f"{name}: balls cannot be set in a scene with ball_contact")
    ball, radius = _ball(name, scene), scene.race.radius
    deck, axes = motion_of(DECK, scene, now), matrix_of(now.turn)
    angle = now.psi + float(now.theta[ball])
    if pose is not None:
        place = axes.T @ np.subtract(pose.position, deck.pose.position)
        angle += math.remainder(math.atan2(place[1], place[0]) - angle, 2.0 * math.pi)
        off = math.dist(place, _on_race(scene, ball, angle))
        if off > _OFF_RACE * radius:
            raise InputError(
                f"{name}: position is {off:g} m off its race; must be within "
                f"{_OFF_RACE * radius:g} m"
            )
        further = angle - now.psi - float(now.theta[ball])
        within, turns = reduced(float(kept.state[layout.angles][ball]) + further)
        kept.state[layout.angles][ball] = within
        kept.discrete_state[ball, TURNS] += int(turns)
    if velocity is not None:
        along = axes @ [-math.sin(angle), math.cos(angle), 0.0]
        lever = axes @ _on_race(scene, ball, angle)
        carried = np.add(deck.velocity.linear, np.cross(now.angular_velocity, lever))
        rate = float(along @ np.subtract(velocity.linear, carried)) / radius - now.omega
        kept.state[layout.rates][ball] = rate
        # Static friction holds no ball that moves.
        kept.discrete_state[ball, DIRECTION] = int(np.sign(rate))


def _ball(name: str, scene: Scene) -> int:
    """Return the number of the ball with a body's name."""
    return body_names(scene).index(name) - body_names(scene).index(ball_frame(0))


def _on_race(scene: Scene, ball: int, angle: float) -> list[float]:
    """Return the position on deck axes [m] of a ball at an angle from the deck's x axis [rad]."""
    radius, height = scene.race.radius, scene.race.heights[scene.balls.races[ball]]
    return [radius * math.cos(angle), radius * math.sin(angle), height]

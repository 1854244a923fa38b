"""Deck in space: quaternions (w, x, y, z) of any length, rotations, and forces of its mounts.

See docs/equations.md, 4.
"""

from collections.abc import Sequence
from typing import Any

from ab_sim.model.equations.sums import Number, any_has, over_effects

Turn = tuple[Number, ...]
"""Rotation from deck axes to the ground's, row by row: nine numbers."""


def turn_of(quaternion: Sequence[Number]) -> Turn:
    """Return the rotation matrix of a quaternion (w, x, y, z) of any length except 0."""
    w, x, y, z = quaternion
    # The division by the squared norm makes the matrix exact although steps change the length.
    two = 2.0 / (w * w + x * x + y * y + z * z)
    xx, yy, zz = two * x * x, two * y * y, two * z * z
    xy, xz, yz = two * x * y, two * x * z, two * y * z
    wx, wy, wz = two * w * x, two * w * y, two * w * z
    return (
        *(1.0 - yy - zz, xy - wz, xz + wy),
        *(xy + wz, 1.0 - xx - zz, yz - wx),
        *(xz - wy, yz + wx, 1.0 - xx - yy),
    )


def to_ground(turn: Turn, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number]:
    """Return a vector on the ground's axes, from its components on deck axes."""
    return (
        turn[0] * x + turn[1] * y + turn[2] * z,
        turn[3] * x + turn[4] * y + turn[5] * z,
        turn[6] * x + turn[7] * y + turn[8] * z,
    )


def to_deck(turn: Turn, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number]:
    """Return a vector on deck axes, from its components on the ground's axes."""
    return (
        turn[0] * x + turn[3] * y + turn[6] * z,
        turn[1] * x + turn[4] * y + turn[7] * z,
        turn[2] * x + turn[5] * y + turn[8] * z,
    )


def half_product(
    q: Sequence[Number], x: Number, y: Number, z: Number
) -> tuple[Number, Number, Number, Number]:
    """Return q (0, x, y, z) / 2, the quaternion's rate for an angular velocity on body axes."""
    w, a, b, c = q
    return (
        -0.5 * (a * x + b * y + c * z),
        0.5 * (w * x + b * z - c * y),
        0.5 * (w * y + c * x - a * z),
        0.5 * (w * z + a * y - b * x),
    )


def cross(a: Sequence[Number], b: Sequence[Number]) -> tuple[Number, Number, Number]:
    """Return the cross product a x b of two vectors."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


PLACE, STIFFNESS, DAMPING, AXES = 0, 3, 6, 9
"""First columns, in the table of mounts, of position on deck axes [m], stiffness [N/m] and damping
[N s/m] along the mount's three axes, and these axes, one after the other, on the ground's axes."""
MOUNT_WIDTH = 18
"""Number of columns per mount, with the units ``MOUNT_UNITS``."""
MOUNT_UNITS = ("m",) * 3 + ("N/m",) * 3 + ("N s/m",) * 3 + ("1",) * 9


def _at_mount(mount: Sequence[Number], turn: Turn, state: Sequence[Number]) -> tuple[Any, Any]:
    """Return displacement [m] and velocity [m/s] of the deck at a mount, along the mount's axes."""
    place, omega = mount[PLACE:STIFFNESS], state[10:13]
    there = to_ground(turn, *place)
    moved = [state[j] + there[j] - place[j] for j in range(3)]
    turning = to_ground(turn, *cross(omega, place))
    velocity = [state[7 + j] + turning[j] for j in range(3)]
    return _along_axes(mount, moved), _along_axes(mount, velocity)


def mount_forces(
    deck: Any, effects: Any, turn: Turn, state: Sequence[Number]
) -> tuple[Number, ...]:
    """Return force [N] and moment about C [N m] of all mounts on the deck, on deck axes."""
    force, moment = [0.0] * 3, [0.0] * 3
    for mount in deck.mounts:
        moved, velocity = _at_mount(mount, turn, state)
        stiffening = 0.0
        if any_has(effects, "mount_stiffening"):
            square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]
            stiffening = over_effects(effects, "mount_stiffening", 0.0, square)
        pulls = [
            -(mount[STIFFNESS + k] + stiffening) * moved[k] - mount[DAMPING + k] * velocity[k]
            for k in range(3)
        ]
        ground = [_sum_of(mount[AXES + 3 * k + j] * pulls[k] for k in range(3)) for j in range(3)]
        on_deck = to_deck(turn, *ground)
        force = [f + g for f, g in zip(force, on_deck, strict=True)]
        arm = cross(mount[PLACE:STIFFNESS], on_deck)
        moment = [t + g for t, g in zip(moment, arm, strict=True)]
    return (*force, *moment)


def mount_loss(deck: Any, turn: Turn, state: Sequence[Number]) -> Number:
    """Return the power that all mounts dissipate [W]."""
    loss = 0.0
    for mount in deck.mounts:
        _, velocity = _at_mount(mount, turn, state)
        for k in range(3):
            loss = loss + mount[DAMPING + k] * velocity[k] * velocity[k]
    return loss


def mount_energy(deck: Any, effects: Any, turn: Turn, state: Sequence[Number]) -> Number:
    """Return the energy stored in all mounts [J]."""
    energy = 0.0
    for mount in deck.mounts:
        moved, _ = _at_mount(mount, turn, state)
        for k in range(3):
            energy = energy + 0.5 * mount[STIFFNESS + k] * moved[k] * moved[k]
        square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]
        energy = energy + over_effects(effects, "mount_energy", 0.0, square)
    return energy


def _sum_of(terms: Any) -> Number:
    """Return the sum of numbers from left to right, without an initial zero."""
    first, *others = terms
    for term in others:
        first = first + term
    return first


def _along_axes(mount: Sequence[Number], vector: Sequence[Number]) -> list[Number]:
    """Return the components of a vector on the ground's axes along the axes of a mount."""
    return [_sum_of(mount[AXES + 3 * k + j] * vector[j] for j in range(3)) for k in range(3)]

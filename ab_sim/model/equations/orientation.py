"""Orientation of a body in space: quaternions (w, x, y, z) of any length, and rotations."""

from collections.abc import Sequence

from ab_sim.model.equations.sums import Number

Turn = tuple[Number, ...]
"""Rotation from deck axes to the ground's, row by row: nine numbers."""


def turn_of(quaternion: Sequence[Number]) -> Turn:
    """Return the rotation of a quaternion of any length."""
    w, x, y, z = quaternion
    # Dividing by the squared norm allows any length.
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
    """Return a vector on deck axes, converted to the ground's."""
    return (
        turn[0] * x + turn[1] * y + turn[2] * z,
        turn[3] * x + turn[4] * y + turn[5] * z,
        turn[6] * x + turn[7] * y + turn[8] * z,
    )


def to_deck(turn: Turn, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number]:
    """Return a vector on the ground's axes, converted to deck axes."""
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
    """Return a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )

"""How a body lies in space: quaternions (w, x, y, z) of any length, and what turns with them."""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import INLINED


@register_jitable(**INLINED)
def turn_of(state: Any) -> Any:
    """The turn from deck axes to the ground's, row by row: nine numbers."""
    w, x, y, z = state[3], state[4], state[5], state[6]
    # Divided by its square, the quaternion may have any length.
    two = 2.0 / (w * w + x * x + y * y + z * z)
    xx, yy, zz = two * x * x, two * y * y, two * z * z
    xy, xz, yz = two * x * y, two * x * z, two * y * z
    wx, wy, wz = two * w * x, two * w * y, two * w * z
    return (
        *(1.0 - yy - zz, xy - wz, xz + wy),
        *(xy + wz, 1.0 - xx - zz, yz - wx),
        *(xz - wy, yz + wx, 1.0 - xx - yy),
    )


@register_jitable(**INLINED)
def to_ground(turn: Any, x: Any, y: Any, z: Any) -> Any:
    """A vector on deck axes, on the ground's."""
    return (
        turn[0] * x + turn[1] * y + turn[2] * z,
        turn[3] * x + turn[4] * y + turn[5] * z,
        turn[6] * x + turn[7] * y + turn[8] * z,
    )


@register_jitable(**INLINED)
def to_deck(turn: Any, x: Any, y: Any, z: Any) -> Any:
    """A vector on the ground's axes, on deck axes."""
    return (
        turn[0] * x + turn[3] * y + turn[6] * z,
        turn[1] * x + turn[4] * y + turn[7] * z,
        turn[2] * x + turn[5] * y + turn[8] * z,
    )


@register_jitable(**INLINED)
def half_product(q: Any, x: Any, y: Any, z: Any) -> Any:
    """q (0, x, y, z) / 2: of an angular velocity on the body's axes the quaternion's rate."""
    w, a, b, c = q
    return (
        -0.5 * (a * x + b * y + c * z),
        0.5 * (w * x + b * z - c * y),
        0.5 * (w * y + c * x - a * z),
        0.5 * (w * z + a * y - b * x),
    )


@register_jitable(**INLINED)
def turning_of(q: Any, r: Any) -> Any:
    """The (x, y, z) for which ``half_product`` is r, but for what of r is along q."""
    w, a, b, c = q
    two = 2.0 / (w * w + a * a + b * b + c * c)
    return (
        two * (w * r[1] - a * r[0] - b * r[3] + c * r[2]),
        two * (w * r[2] - b * r[0] - c * r[1] + a * r[3]),
        two * (w * r[3] - c * r[0] - a * r[2] + b * r[1]),
    )

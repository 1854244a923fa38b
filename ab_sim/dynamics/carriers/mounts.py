"""What the mounts of a deck in space do to it: docs/equations.md, 4."""

from typing import Any

from numba.extending import register_jitable

from ab_sim.dynamics.carriers.orientation import to_deck, to_ground
from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.system import has_stiffening, mount_stiffening

PLACE, STIFFNESS, DAMPING, AXES = 0, 3, 6, 9
"""First columns of a mount: where it is on deck axes [m]; stiffness [N/m] and damping [N s/m] along
its three axes; these axes on the ground's, one after the other."""
MOUNT_WIDTH = 18


@register_jitable(**INLINED)
def at_mount(deck: Any, turn: Any, state: Any, k: Any) -> Any:
    """Displacement [m] and speed [m/s] of the deck at mount k, along the mount's axes."""
    mounts = deck.mounts
    px, py, pz = mounts[k, PLACE], mounts[k, PLACE + 1], mounts[k, PLACE + 2]
    ox, oy, oz = state[10], state[11], state[12]
    gx, gy, gz = to_ground(turn, px, py, pz)
    dx, dy, dz = state[0] + gx - px, state[1] + gy - py, state[2] + gz - pz
    gx, gy, gz = to_ground(turn, oy * pz - oz * py, oz * px - ox * pz, ox * py - oy * px)
    vx, vy, vz = state[7] + gx, state[8] + gy, state[9] + gz
    a, b, c = AXES, AXES + 3, AXES + 6
    return (
        (
            mounts[k, a] * dx + mounts[k, a + 1] * dy + mounts[k, a + 2] * dz,
            mounts[k, b] * dx + mounts[k, b + 1] * dy + mounts[k, b + 2] * dz,
            mounts[k, c] * dx + mounts[k, c + 1] * dy + mounts[k, c + 2] * dz,
        ),
        (
            mounts[k, a] * vx + mounts[k, a + 1] * vy + mounts[k, a + 2] * vz,
            mounts[k, b] * vx + mounts[k, b + 1] * vy + mounts[k, b + 2] * vz,
            mounts[k, c] * vx + mounts[k, c + 1] * vy + mounts[k, c + 2] * vz,
        ),
    )


@register_jitable(**INLINED)
def mount_forces(deck: Any, system: Any, turn: Any, state: Any) -> Any:
    """Force of all mounts on the deck [N], and its moment about C [N m], on deck axes."""
    mounts = deck.mounts
    fx = fy = fz = tx = ty = tz = 0.0
    for k in range(mounts.shape[0]):
        moved, speed = at_mount(deck, turn, state, k)
        stiffening = 0.0
        if has_stiffening(system.effects):
            square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]
            stiffening = mount_stiffening(system.effects, square)
        f1 = mount_force(mounts, k, 0, stiffening, moved[0], speed[0])
        f2 = mount_force(mounts, k, 1, stiffening, moved[1], speed[1])
        f3 = mount_force(mounts, k, 2, stiffening, moved[2], speed[2])
        a, b, c = AXES, AXES + 3, AXES + 6
        gx = mounts[k, a] * f1 + mounts[k, b] * f2 + mounts[k, c] * f3
        gy = mounts[k, a + 1] * f1 + mounts[k, b + 1] * f2 + mounts[k, c + 1] * f3
        gz = mounts[k, a + 2] * f1 + mounts[k, b + 2] * f2 + mounts[k, c + 2] * f3
        dx, dy, dz = to_deck(turn, gx, gy, gz)
        px, py, pz = mounts[k, PLACE], mounts[k, PLACE + 1], mounts[k, PLACE + 2]
        fx += dx
        fy += dy
        fz += dz
        tx += py * dz - pz * dy
        ty += pz * dx - px * dz
        tz += px * dy - py * dx
    return fx, fy, fz, tx, ty, tz


@register_jitable(**INLINED)
def mount_force(mounts: Any, k: Any, axis: Any, stiffening: Any, moved: Any, speed: Any) -> Any:
    """Force of mount k on the deck along one of its axes [N]."""
    stiffness = mounts[k, STIFFNESS + axis] + stiffening
    return -stiffness * moved - mounts[k, DAMPING + axis] * speed

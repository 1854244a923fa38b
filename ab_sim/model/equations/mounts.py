"""Forces of the mounts on a deck in space: docs/equations.md, 4."""

from collections.abc import Sequence
from typing import Any

from ab_sim.model.equations.orientation import Turn, cross, to_deck, to_ground
from ab_sim.model.equations.sums import Number, any_has, over_effects

PLACE, STIFFNESS, DAMPING, AXES = 0, 3, 6, 9
"""First columns of a mount's place on deck axes [m], of stiffness [N/m] and damping [N s/m] along
its three axes, and of these axes, one after the other, on the ground's axes."""
MOUNT_WIDTH = 18
MOUNT_UNITS = ("m",) * 3 + ("N/m",) * 3 + ("N s/m",) * 3 + ("1",) * 9


def at_mount(mount: Sequence[Number], turn: Turn, state: Sequence[Number]) -> tuple[Any, Any]:
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
    """Return the mounts' force on the deck [N], and its moment about C [N m], on deck axes."""
    force, moment = [0.0] * 3, [0.0] * 3
    for mount in deck.mounts:
        moved, velocity = at_mount(mount, turn, state)
        stiffening = 0.0
        if any_has(effects, "mount_stiffening"):
            square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]
            stiffening = over_effects(effects, "mount_stiffening", 0.0, square)
        pulls = [
            -(mount[STIFFNESS + k] + stiffening) * moved[k] - mount[DAMPING + k] * velocity[k]
            for k in range(3)
        ]
        ground = [sum_of(mount[AXES + 3 * k + j] * pulls[k] for k in range(3)) for j in range(3)]
        on_deck = to_deck(turn, *ground)
        force = [f + g for f, g in zip(force, on_deck, strict=True)]
        arm = cross(mount[PLACE:STIFFNESS], on_deck)
        moment = [t + g for t, g in zip(moment, arm, strict=True)]
    return (*force, *moment)


def mount_loss(deck: Any, turn: Turn, state: Sequence[Number]) -> Number:
    """Return the power that all mounts dissipate [W]."""
    loss = 0.0
    for mount in deck.mounts:
        _, velocity = at_mount(mount, turn, state)
        for k in range(3):
            loss = loss + mount[DAMPING + k] * velocity[k] * velocity[k]
    return loss


def mount_energy(deck: Any, effects: Any, turn: Turn, state: Sequence[Number]) -> Number:
    """Return the energy stored in all mounts [J]."""
    energy = 0.0
    for mount in deck.mounts:
        moved, _ = at_mount(mount, turn, state)
        for k in range(3):
            energy = energy + 0.5 * mount[STIFFNESS + k] * moved[k] * moved[k]
        square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]
        energy = energy + over_effects(effects, "mount_energy", 0.0, square)
    return energy


def sum_of(terms: Any) -> Number:
    """Return the sum of numbers from left to right, without an initial zero."""
    first, *others = terms
    for term in others:
        first = first + term
    return first


def _along_axes(mount: Sequence[Number], vector: Sequence[Number]) -> list[Number]:
    return [sum_of(mount[AXES + 3 * k + j] * vector[j] for j in range(3)) for k in range(3)]

"""Nonlinear stability test of the three-ball paper.

It decides states that the linear test leaves undecided (three-ball, section 4). A state is stable
if the motion returns to it from a disturbance along each coordinate, one at a time. All resting
states of a continuum are equivalent, so returning to any of them counts: only deck and rates are
compared.
"""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.equilibria.resting import resting_system, running_at, state_of
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.base.errors import InputError
from ab_sim.drive import Drive
from ab_sim.scene.model import Scene

SIZE = 0.2
"""Default size of a disturbance; its units are those of ``settles``.

It is not small: where the linear test is undecided, disturbances decay algebraically, and small
ones too slowly to be seen.
"""
NEARER = 0.75
"""Fraction of a disturbance that may remain at the end if the motion still approaches the state."""
BACK = 1e-6
"""Scaled distance below which a motion has returned to the state."""
_MOST_STEPS = 1e8
"""Largest number of steps of all motions together."""
TURNS = 2000.0
"""Duration of each motion in spindle revolutions."""


class DisturbanceOutcome(NamedTuple):
    """Result of one disturbance; distances are scaled, and the largest over all states."""

    coordinate: str
    """Sign of the disturbance and name of the state."""
    start: float
    """Distance of the disturbed state from the resting state at the start."""
    middle: float
    """Distance from the resting state after half the time."""
    rest: float
    """Distance from the resting state at the end."""

    @property
    def returned(self) -> bool:
        """True if the motion has returned or is still approaching."""
        nearer = self.rest <= NEARER * self.start and self.rest < self.middle
        return nearer or self.rest <= BACK


class Settling(NamedTuple):
    """Result of the nonlinear test."""

    outcomes: tuple[DisturbanceOutcome, ...]
    """Results of all disturbances: two per state, in both directions."""

    @property
    def stable(self) -> bool:
        """True if the motion returns after each disturbance."""
        return all(outcome.returned for outcome in self.outcomes)


def settles(
    scene: Scene, speed: float, state: RestingState, size: float = SIZE, turns: float = TURNS
) -> Settling:
    """Test whether motions return to a resting state after a disturbance of each coordinate.

    Each coordinate is disturbed in both directions. Friction and contact are left out, as in the
    search for the state.

    Parameters
    ----------
    scene
        Scene of the state.
    speed
        Spindle speed w [rad/s], not 0.
    state
        State from ``equilibria_of``.
    size
        Size of the disturbances: of ball angles in rad, of displacements as a fraction of the
        length unit e, of velocities of e w, of ball rates of w.
    turns
        Duration of each motion in spindle revolutions.

    Raises
    ------
    SceneError
        As ``equilibria_of``.
    InputError
        The speed is so low that ``turns`` revolutions need too many steps.
    DivergedError
        A motion leaves all bounds.
    """
    system = resting_system(scene)
    n, length = len(system.balls), scene.whirl_unit[0]
    rest = state_of(system, speed, state.u, state.theta)
    deck = [length, length, length * speed, length * speed]
    scale = np.abs(np.array([*deck, *[1.0] * n, *[speed] * n]))
    drive = Drive(running_at(scene, speed, tuple(state.theta.tolist())))
    steps = max(1, math.ceil(turns * math.pi / abs(speed) / drive.step))
    in_all = 4 * len(rest) * steps
    if in_all > _MOST_STEPS:
        raise InputError(
            f"speed = {speed:g} rad/s: {turns:g} turns from each disturbance would take "
            f"{in_all:.2g} steps; at most {_MOST_STEPS:.0e} are allowed; choose a higher speed or "
            "fewer turns"
        )
    begin = drive.snapshot()
    outcomes = []
    for k, name in enumerate(drive.vector_field().layout.names):
        for sign in (1.0, -1.0):
            moved = rest.copy()
            moved[k] += sign * size * scale[k]
            # Clear the stepper's memory, which belongs to another state.
            drive.restore(begin._replace(state=moved, memory=np.empty(0)))
            distances = []
            for _ in range(2):
                drive.advance(steps, every=steps)
                final = drive.snapshot().state
                distances.append(_distance(final, rest, scale, n, state.structural_zeros))
            label = f"{'+' if sign > 0 else '-'} {name}"
            outcomes.append(DisturbanceOutcome(label, size, *distances))
    return Settling(tuple(outcomes))


def _distance(final: np.ndarray, rest: np.ndarray, scale: np.ndarray, n: int, zeros: int) -> float:
    """Return the largest scaled difference of two states.

    Parameters
    ----------
    final, rest
        States, shape (4 + 2 n,).
    scale
        Magnitudes of the states, same shape.
    n
        Number of balls.
    zeros
        Number of structural zeros; in a continuum (above 0) ball angles are ignored.
    """
    apart = (final - rest) / scale
    apart[4 : 4 + n] = np.angle(np.exp(1j * apart[4 : 4 + n]))
    if zeros:
        apart[4 : 4 + n] = 0.0
    return float(np.abs(apart).max())

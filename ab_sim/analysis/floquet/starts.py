"""Starting states of the search for a periodic solution."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.optimize import least_squares

from ab_sim.analysis.floquet.turn import Orbit, TurnMap
from ab_sim.model.dynamics.system import MASS, RACE_HEIGHT, RACE_RADIUS

TURNS = 500
"""Largest number of spindle revolutions for settling."""


def from_start(turn: TurnMap) -> np.ndarray:
    """Return the initial state of the scene."""
    return turn.scene_start()


def from_balance(turn: TurnMap) -> np.ndarray:
    """Return the deck at rest, with balls at their best balancing positions.

    The position nearest to evenly spread balls is chosen; more than two balls have many.
    """
    state = np.zeros(turn.layout.size)
    state[turn.layout.deck] = turn.rest()
    state[turn.layout.angles] = balanced_angles(turn)
    return state


def from_settling(turn: TurnMap) -> np.ndarray:
    """Return the state after up to ``TURNS`` revolutions at constant speed from the scene's start.

    Raises:
        FloatingPointError: the motion grows without bound.
    """
    state = turn.scene_start()
    for _ in range(TURNS):
        before, state = state, turn.after_turn(state, turn.fewest)
        if not np.isfinite(state).all():
            raise FloatingPointError("the motion grows beyond all bounds")
        if (np.abs(state - before) <= 1e-9 * turn.scale).all():
            break
    return state


STARTS: Mapping[str, Callable[[TurnMap], np.ndarray]] = {
    "start": from_start,
    "balanced": from_balance,
    "settled": from_settling,
}
"""Starting states by name, in the order in which they are tried."""


def balanced_angles(turn: TurnMap) -> np.ndarray:
    """Return the ball angles that best cancel the rotor's unbalance, shape (n,).

    For a deck in space they also cancel its couple unbalance.
    """
    n, balls, scene = len(turn.system.balls), turn.system.balls, turn.scene
    if n == 0:
        return np.zeros(0)
    heavy = balls[:, MASS] * balls[:, RACE_RADIUS]
    levers, rotor = [heavy], [turn.system.deck_model.unbalance + 0.0j]
    if scene.deck is not None:
        levers.append(heavy * balls[:, RACE_HEIGHT] / scene.race.radius)
        rotor.append(scene.couple_unbalance / scene.race.radius)

    def residual(angles: np.ndarray) -> np.ndarray:
        sums = np.array(levers) @ np.exp(1j * angles) + np.array(rotor)
        return np.concatenate([sums.real, sums.imag]) / heavy.sum()

    spread = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    fit = least_squares(residual, spread, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return np.asarray(fit.x)


def find_orbit(turn: TurnMap, names: Sequence[str]) -> tuple[Orbit | None, str]:
    """Return the first periodic solution found and the name of its start; None if none is found."""
    for name in names:
        try:
            orbit = turn.shoot(STARTS[name](turn))
        except FloatingPointError:
            continue
        if orbit is not None:
            return orbit, name
    return None, ""

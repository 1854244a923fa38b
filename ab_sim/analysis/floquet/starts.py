"""Where the search for a periodic solution begins."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.optimize import least_squares

from ab_sim.analysis.floquet.turn import Orbit, TurnMap
from ab_sim.dynamics.system import MASS, RACE_HEIGHT, RACE_RADIUS

TURNS = 500
"""That a drive is given to settle in."""


def from_start(turn: TurnMap) -> np.ndarray:
    """The state that the scene starts in."""
    return turn.scene_start()


def from_balance(turn: TurnMap) -> np.ndarray:
    """The deck where it hangs, and balls where they balance the rotor as well as they can.

    The nearest such place to balls spread evenly: of more than two, one of many.
    """
    state = np.zeros(turn.layout.size)
    state[turn.layout.deck] = turn.rest()
    state[turn.layout.angles] = balanced_angles(turn)
    return state


def from_settling(turn: TurnMap) -> np.ndarray:
    """What the scene's start has become after some hundreds of turns at the held speed.

    Raises:
        FloatingPointError: it has gone beyond all bounds.
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
"""By their names, in the order in which they are tried."""


def balanced_angles(turn: TurnMap) -> np.ndarray:
    """Angles at which the balls' unbalance, and on a deck in space their couple, undo the rotor's.

    As well as they can; shape (n,).
    """
    n, balls, scene = len(turn.system.balls), turn.system.balls, turn.scene
    if n == 0:
        return np.zeros(0)
    heavy = balls[:, MASS] * balls[:, RACE_RADIUS]
    levers, rotor = [heavy], [turn.system.deck_model.unbalance + 0.0j]
    if scene.deck is not None:
        levers.append(heavy * balls[:, RACE_HEIGHT] / scene.race.radius)
        rotor.append(scene.couple_unbalance / scene.race.radius)

    def left(angles: np.ndarray) -> np.ndarray:
        sums = np.array(levers) @ np.exp(1j * angles) + np.array(rotor)
        return np.concatenate([sums.real, sums.imag]) / heavy.sum()

    spread = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    found = least_squares(left, spread, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return np.asarray(found.x)


def find_orbit(turn: TurnMap, names: Sequence[str]) -> tuple[Orbit | None, str]:
    """The periodic solution found first, and from which start; None where none is found."""
    for name in names:
        try:
            found = turn.shoot(STARTS[name](turn))
        except FloatingPointError:
            continue
        if found is not None:
            return found, name
    return None, ""

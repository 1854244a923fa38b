"""Where a deck hangs at rest: its weight beside what holds it."""

from collections.abc import Callable

import numpy as np

FARTHEST = 1e6
"""m; what holds no weight within it holds none."""
NO_WEIGHT = 1e-100
"""N; the square of less is no number, and nothing hangs from it."""
BALANCED = 1e-9
"""Of the weight; what may be left of forces."""


def place_at_rest(
    unbalanced: Callable[[np.ndarray], np.ndarray],
    stored: Callable[[np.ndarray], float],
    weight: np.ndarray,
    turns: int = 0,
) -> np.ndarray | None:
    """Where forces balance, looked for down the weight.

    Args:
        unbalanced: forces, and moments, over the weight, by displacement [m] and turn [rad].
        stored: energy in the springs [J], by displacement.
        weight: N, shape (ways,).
        turns: how many angles there are behind the displacement.

    Returns:
        Displacement and turn, shape (ways + turns,); None if none is found.
    """
    from scipy.optimize import approx_fprime, root  # takes as long as a run to import

    size = float(np.linalg.norm(weight))
    if not size > NO_WEIGHT:
        return np.zeros(len(weight) + turns)
    down, reach = weight / size, 1e-9
    # Down the weight until the springs have stored as much as it has done work.
    while stored(reach * down) < reach * size and reach < FARTHEST:
        reach *= 2.0
    # In metres the search loses itself.
    scale = np.append(np.full(len(weight), reach), np.ones(turns))

    def in_reaches(place: np.ndarray) -> np.ndarray:
        return unbalanced(scale * place)

    def slopes(place: np.ndarray) -> np.ndarray:
        # Its own differences are of steps that vanish where a number does but for rounding.
        return np.asarray(approx_fprime(place, in_reaches, 1e-7))

    start = np.append(0.5 * down, np.zeros(turns))
    found = scale * root(in_reaches, start, jac=slopes, tol=1e-15).x
    return found if np.abs(unbalanced(found)).max() <= BALANCED else None

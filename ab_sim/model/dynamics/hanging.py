"""Equilibrium position of a deck under its weight."""

from collections.abc import Callable

import numpy as np

FARTHEST = 1e6
"""Largest sag [m]; a suspension that sags further counts as not holding the weight."""
NO_WEIGHT = 1e-100
"""Weight below which there is no sag [N]: its square would underflow."""
BALANCED = 1e-9
"""Largest residual of forces, relative to the weight."""


def place_at_rest(
    unbalanced: Callable[[np.ndarray], np.ndarray],
    stored: Callable[[np.ndarray], float],
    weight: np.ndarray,
    turns: int = 0,
) -> np.ndarray | None:
    """Return the equilibrium position, searched for in the direction of the weight.

    Args:
        unbalanced: function of displacement [m] and turn [rad] that returns forces and moments
            relative to the weight.
        stored: function of the displacement that returns the energy in the springs [J].
        weight: weight of the deck [N], one component per axis, shape (axes,).
        turns: number of components of the turn, which follow those of the displacement.

    Returns:
        Displacement [m] and turn [rad], shape (axes + turns,); None if no solution is found.
    """
    from scipy.optimize import approx_fprime, root  # takes as long as a run to import

    size = float(np.linalg.norm(weight))
    if not size > NO_WEIGHT:
        return np.zeros(len(weight) + turns)
    down, reach = weight / size, 1e-9
    # Start at the distance over which the springs store the work of the weight.
    while stored(reach * down) < reach * size and reach < FARTHEST:
        reach *= 2.0
    # The search uses this distance as the unit of length, because it fails in metres.
    scale = np.append(np.full(len(weight), reach), np.ones(turns))

    def in_reaches(place: np.ndarray) -> np.ndarray:
        return unbalanced(scale * place)

    def slopes(place: np.ndarray) -> np.ndarray:
        # The step of the solver's own differences vanishes for a number that is 0 up to rounding.
        return np.asarray(approx_fprime(place, in_reaches, 1e-7))

    start = np.append(0.5 * down, np.zeros(turns))
    rest = scale * root(in_reaches, start, jac=slopes, tol=1e-15).x
    return rest if np.abs(unbalanced(rest)).max() <= BALANCED else None

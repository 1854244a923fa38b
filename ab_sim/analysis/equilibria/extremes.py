"""Worst and best balanced position of equal balls.

The eigenvalues depend on a position only through rho, see ``balanced``. Let t_i be the tangents on
the rotating axes, and t = U S V^T with S = diag(sqrt(n (1 +- rho) / 2)). The motion along the two
columns of V acts on the deck; the motion normal to them does not, and has the same rates at all
positions. Eight equations remain: four of the deck, and angle and rate along two columns of V. With
the mass matrix on the left, rho enters only through S, which multiplies the coupling of balls and
deck. The growth rate of all positions is thus a function of one number, whose extremes are computed
here.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from ab_sim.analysis.equilibria.balanced import doubling, ends, position_at, positions, symmetric
from ab_sim.analysis.equilibria.resting import ClosedFormRotor, field_at, state_of
from ab_sim.model.dynamics.layout import layout_of
from ab_sim.model.dynamics.system import MOMENT, RACE_RADIUS, ROLLING_MASS, System

LEVELS = 33
"""Number of levels of rho between which the extremes of the growth rate are bracketed."""
NARROW = 1e-9
"""Width of the range of rho below which it counts as a single position."""
CLOSE = 1e-8
"""Tolerance of rho, as a fraction of its range."""

ALL, SAMPLED = "all", "sampled"
Growth = Callable[[np.ndarray], np.ndarray]


def known_positions(rotor: ClosedFormRotor | None, balls: int) -> str | None:
    """Return the set of positions among which worst and best are known: ``ALL`` or ``SAMPLED``.

    Args:
        rotor: rotor of a ``resting_system``; None if states are found numerically.
        balls: number of balls.

    Returns:
        ``ALL`` or ``SAMPLED``; None for fewer than three balls, which have one position apart from
        its mirror image.
    """
    if balls < 3:
        return None
    return ALL if rotor is not None and len({*rotor.kinds}) == 1 else SAMPLED


def positions_at(system: System, rotor: ClosedFormRotor, speed: float) -> list[np.ndarray]:
    """Return balanced positions [rad] that include the worst and the best at a nonzero speed.

    For three or more equal balls: the symmetric position, and the worst and best of all. Otherwise
    ``positions``, a sample if three or more balls differ.
    """
    middle = symmetric(rotor)
    if middle is None or len(middle) < 3:
        return [*positions(rotor)]
    low, high = ends(rotor)
    first, last = doubling(rotor, low), doubling(rotor, high)
    if last - first <= NARROW:
        return [middle]
    growth, levels = growths(system, speed, low), np.linspace(first, last, LEVELS)
    seen = growth(levels)
    worst = _least(lambda rhos: -growth(rhos), levels, -seen)
    best = _least(growth, levels, seen)
    return [middle, position_at(rotor, worst), position_at(rotor, best)]


def _least(growth: Growth, levels: np.ndarray, seen: np.ndarray) -> float:
    """Return the minimiser of a function, refined around each local minimum of its samples."""
    around = np.pad(seen, 1, constant_values=np.inf)
    low = np.flatnonzero((seen <= around[:-2]) & (seen <= around[2:]))
    close = CLOSE * (levels[-1] - levels[0])
    best = int(seen.argmin())
    rho, least = float(levels[best]), float(seen[best])
    at_ends = growth(np.array([levels[0] + close, levels[-1] - close]))
    for k in low.tolist():
        if k in (0, len(levels) - 1) and seen[k] <= at_ends[min(k, 1)]:
            continue  # the growth rises from this end: no interior minimum
        bounds = levels[max(k - 1, 0)], levels[min(k + 1, len(levels) - 1)]
        minimum = minimize_scalar(
            lambda x: float(growth(np.array([x]))[0]), bounds=bounds, method="bounded",
            options={"xatol": close},
        )  # fmt: skip
        if minimum.fun < least:
            rho, least = float(minimum.x), float(minimum.fun)
    return rho


def growths(system: System, speed: float, theta: np.ndarray) -> Growth:
    """Return a function of rho: the largest real part [1/s] of the eight eigenvalues.

    Args:
        system: a ``resting_system`` of equal balls in an isotropic suspension.
        speed: spindle speed w [rad/s], not 0.
        theta: any balanced position with rho < 1.
    """
    layout, n = layout_of(system), len(theta)
    mass, moment = system.deck_model.total_mass, float(system.balls[0, MOMENT])
    inertia = float(system.balls[0, ROLLING_MASS] * system.balls[0, RACE_RADIUS] ** 2)
    tangents = np.array([-np.sin(theta), np.cos(theta)])
    turn, reach, along = np.linalg.svd(tangents)
    basis = np.zeros((layout.size, 8))
    basis[layout.deck, :4] = np.kron(np.eye(2), turn)
    basis[layout.angles, 4:6], basis[layout.rates, 6:] = along[:2].T, along[:2].T
    jacobian = field_at(system, speed).jacobian(0.0, state_of(system, speed, np.zeros(2), theta))
    across = along[2:].T if n > 2 else np.zeros((n, 0))
    # Damping of a single ball, taken from a motion that does not act on the deck.
    alone = across[:, 0] @ jacobian[layout.rates, layout.rates] @ across[:, 0]

    def masses(reaches: np.ndarray) -> np.ndarray:
        matrix = np.empty((*reaches.shape[:-1], 8, 8))
        matrix[:] = np.eye(8)
        for axis in (0, 1):
            matrix[..., 2 + axis, 2 + axis] = mass
            matrix[..., 2 + axis, 6 + axis] = moment * reaches[..., axis]
            matrix[..., 6 + axis, 2 + axis] = moment / inertia * reaches[..., axis]
        return matrix

    here = masses(reach) @ (basis.T @ jacobian @ basis)
    block = np.zeros((8, 8))
    block[4:6, 6:] = np.eye(2)
    block[6:, 6:] = alone * np.eye(2)

    def at(rhos: np.ndarray) -> np.ndarray:
        reaches = np.sqrt(0.5 * n * (1.0 + np.multiply.outer(rhos, [1.0, -1.0])).clip(0.0))
        scales = np.ones((len(rhos), 8))
        scales[:, 4:6] = scales[:, 6:] = reaches / reach
        scaled = block + (here - block) * scales[:, :, None] * scales[:, None, :]
        matrices = np.linalg.solve(masses(reaches), scaled)
        return np.linalg.eigvals(matrices).real.max(axis=1)

    return at

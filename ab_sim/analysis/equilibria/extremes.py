"""The worst and the best of all balanced positions of equal balls.

Only rho of a position enters its eigenvalues, see ``balanced``. With the ball angles' part that
reaches the deck in an orthonormal basis, t = U S V^T for t_i the tangents on the rotating axes and
S = diag(sqrt(n (1 +- rho) / 2)), what is left of the equations are eight: the deck's four, and
angle and rate along two columns of V. There S is all that rho changes: with the masses brought to
the left, it multiplies what the balls and the deck do to each other. What is across V does not
reach the deck, and has the same rates at all positions. So the growth of all positions is a
function of one number, whose extremes can be looked for.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from ab_sim.analysis.equilibria.balanced import doubling, ends, position_at, positions, symmetric
from ab_sim.analysis.equilibria.resting import ClosedFormRotor, field_at, state_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.system import MOMENT, RACE_RADIUS, ROLLING_MASS, System

LEVELS = 33
"""Of rho, between two of which the growth's extremes are looked for."""
NARROW = 1e-9
"""A range of rho that is one position."""
CLOSE = 1e-8
"""How well rho is found, in its range."""

ALL, SAMPLED = "all", "sampled"
Growth = Callable[[np.ndarray], np.ndarray]


def known_positions(rotor: ClosedFormRotor | None, balls: int) -> str | None:
    """Of which balanced positions worst and best are known: ``ALL`` or ``SAMPLED`` ones.

    Args:
        rotor: of a ``resting_system``; None where states are found by numbers.
        balls: how many.

    Returns:
        None of fewer than three balls, which have one position, but for its mirror image.
    """
    if balls < 3:
        return None
    return ALL if rotor is not None and len({*rotor.kinds}) == 1 else SAMPLED


def positions_at(system: System, rotor: ClosedFormRotor, speed: float) -> list[np.ndarray]:
    """Balanced positions [rad] of which one is worst and one is best at a speed [rad/s], not 0.

    Of three and more equal balls the symmetric one, and the worst and the best of all; of others
    ``positions``, of which three and more balls have others besides.
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
    """Where a function is least: looked for about each level at which it is less than beside."""
    around = np.pad(seen, 1, constant_values=np.inf)
    low = np.flatnonzero((seen <= around[:-2]) & (seen <= around[2:]))
    close = CLOSE * (levels[-1] - levels[0])
    best = int(seen.argmin())
    rho, least = float(levels[best]), float(seen[best])
    at_ends = growth(np.array([levels[0] + close, levels[-1] - close]))
    for k in low.tolist():
        if k in (0, len(levels) - 1) and seen[k] <= at_ends[min(k, 1)]:
            continue  # it rises from this end
        bounds = levels[max(k - 1, 0)], levels[min(k + 1, len(levels) - 1)]
        found = minimize_scalar(
            lambda x: float(growth(np.array([x]))[0]), bounds=bounds, method="bounded",
            options={"xatol": close},
        )  # fmt: skip
        if found.fun < least:
            rho, least = float(found.x), float(found.fun)
    return rho


def growths(system: System, speed: float, theta: np.ndarray) -> Growth:
    """The largest real part [1/s] that the eight eigenvalues have, as a function of rho.

    Args:
        system: a ``resting_system`` of equal balls in an isotropic suspension.
        speed: w [rad/s], not 0.
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
    # What one ball does to itself, from a motion that does not reach the deck.
    alone = across[:, 0] @ jacobian[layout.rates, layout.rates] @ across[:, 0]

    def masses(reaches: np.ndarray) -> np.ndarray:
        found = np.empty((*reaches.shape[:-1], 8, 8))
        found[:] = np.eye(8)
        for axis in (0, 1):
            found[..., 2 + axis, 2 + axis] = mass
            found[..., 2 + axis, 6 + axis] = moment * reaches[..., axis]
            found[..., 6 + axis, 2 + axis] = moment / inertia * reaches[..., axis]
        return found

    here = masses(reach) @ (basis.T @ jacobian @ basis)
    own = np.zeros((8, 8))
    own[4:6, 6:] = np.eye(2)
    own[6:, 6:] = alone * np.eye(2)

    def at(rhos: np.ndarray) -> np.ndarray:
        reaches = np.sqrt(0.5 * n * (1.0 + np.multiply.outer(rhos, [1.0, -1.0])).clip(0.0))
        scales = np.ones((len(rhos), 8))
        scales[:, 4:6] = scales[:, 6:] = reaches / reach
        scaled = own + (here - own) * scales[:, :, None] * scales[:, None, :]
        matrices = np.linalg.solve(masses(reaches), scaled)
        return np.linalg.eigvals(matrices).real.max(axis=1)

    return at

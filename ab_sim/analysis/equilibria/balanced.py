"""The balanced set: ball positions whose unbalance cancels the rotor's, so that W is 0.

The sum of m_i R exp(i theta_i) is -M0 e: three-ball (25)-(36), relative-stability (23), (24). One
or two balls have one balanced position, or two that mirror each other. For n >= 3 balls the
positions form a manifold of dimension n - 2.

For equal balls the eigenvalues depend on the position through one number only. A disturbance d_i of
the angles acts on the deck as q = sum t_i d_i and feeds back through T = sum t_i t_i^T. The
eigenvalues of T are n (1 +- rho) / 2 with rho = |sum exp(2 i theta_i)| / n. The principal axes of T
do not matter in an isotropic suspension.

To find the worst and the best position of equal balls, let t = U S V^T with S = diag(sqrt(n (1 +-
rho) / 2)). The motion along the two columns of V acts on the deck; the motion normal to them does
not, and has the same rates at all positions. Eight equations remain: four of the deck, and angle
and rate along two columns of V. With the mass matrix on the left, rho enters only through S, which
multiplies the coupling of balls and deck. The growth rate of all positions is thus a function of
one number, whose extremes are computed here.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from ab_sim.analysis.equilibria.resting import ClosedFormRotor, field_at, state_of
from ab_sim.drive import closed_forms
from ab_sim.model.dynamics.system import MOMENT, RACE_RADIUS, ROLLING_MASS, System, layout_of

_LEVELS = 17
"""Number of balanced positions, at evenly spaced rho from its minimum to its maximum."""
STARTS = 36
"""Number of random starts of the search for the extremes of rho, to be divided by the number of
balls; at least two are used."""
_SCATTER = 48
"""Number of additional random positions if the balls differ."""
_SAME = 1e-12
"""Difference of rho up to which a known balanced position has the requested rho."""


def can_balance(rotor: ClosedFormRotor) -> bool:
    """Return whether the balls can cancel the unbalance: the vectors close to a polygon."""
    return closed_forms.can_balance(rotor.unbalance, rotor.moments)


def symmetric(rotor: ClosedFormRotor) -> np.ndarray | None:
    """Return the balanced position of equal balls that is its own mirror image, or None.

    Balls lie in pairs at +-beta; with an odd number the last ball lies at pi. None if balls differ
    or cannot balance.
    """
    n = len(rotor.moments)
    if n == 0 or len({*rotor.kinds}) > 1 or not can_balance(rotor):
        return None
    need = rotor.unbalance / rotor.moments[0]
    if n == 1:
        return np.array([math.pi])
    odd = n % 2
    beta = closed_forms.acos_of((odd - need) / (n - odd))
    return np.array([-beta, beta] * (n // 2) + [math.pi] * odd)


def completed(rotor: ClosedFormRotor, first_balls: np.ndarray) -> np.ndarray | None:
    """Return all ball angles of a balanced rotor, from the angles of all balls but the last two.

    See ``closed_forms.completed``.
    """
    return closed_forms.completed(rotor.unbalance, rotor.moments, first_balls)


def positions(rotor: ClosedFormRotor) -> np.ndarray:
    """Return balanced positions from one end of the set to the other, shape (positions, n).

    The first is ``symmetric`` if it exists. One or two balls have a single position, apart from its
    mirror image.
    """
    if not can_balance(rotor) or not rotor.moments:
        return np.empty((0, len(rotor.moments)))
    return _positions(rotor.unbalance, rotor.moments, rotor.kinds)


@lru_cache(maxsize=64)
def _positions(unbalance: float, moments: tuple[float, ...], kinds: tuple[int, ...]) -> np.ndarray:
    """Return ``positions`` of a rotor that can balance; its hashable parameters key the cache."""
    rotor = ClosedFormRotor(1.0, unbalance, 0.0, 0.0, 0.0, moments, kinds)
    n, middle = len(moments), symmetric(rotor)
    if n <= 2:
        return np.array([completed(rotor, np.empty(0)) if middle is None else middle])
    starts, low, high = _ends(unbalance, moments, kinds)
    draw = np.random.default_rng(0)
    candidates = [] if middle is None else [middle]
    candidates += _between(rotor, low, high, starts, draw)
    if len({*kinds}) > 1:
        candidates += _balanced_from(rotor, draw.uniform(-math.pi, math.pi, (_SCATTER, n)))
    return np.array(candidates)


def ends(rotor: ClosedFormRotor) -> tuple[np.ndarray, np.ndarray]:
    """Return the balanced positions [rad] with the smallest and the largest rho, n >= 3."""
    _, low, high = _ends(rotor.unbalance, rotor.moments, rotor.kinds)
    return low, high


@lru_cache(maxsize=64)
def _ends(
    unbalance: float, moments: tuple[float, ...], kinds: tuple[int, ...]
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Return some balanced positions, and the positions with the smallest and the largest rho.

    Local extremes of rho are searched from the symmetric position and from random ones, because rho
    has several local extremes along the manifold.
    """
    rotor = ClosedFormRotor(1.0, unbalance, 0.0, 0.0, 0.0, moments, kinds)
    n, middle = len(moments), symmetric(rotor)
    draw = np.random.default_rng(0)
    starts = [] if middle is None else [middle]
    starts += _balanced_from(rotor, draw.uniform(-math.pi, math.pi, (max(2, STARTS // n), n)))
    extremes = [_extreme(rotor, start, sense) for start in starts for sense in (1.0, -1.0)]
    converged = [x for x in extremes if x is not None] or starts
    converged.sort(key=lambda x: doubling(rotor, x))
    return starts, converged[0], converged[-1]


def _position_at(rotor: ClosedFormRotor, rho: float) -> np.ndarray:
    """Return a balanced position [rad] with a given rho, for three or more balls.

    Parameters
    ----------
    rotor
        Unbalance and ball moments.
    rho
        Value between those of the two ``ends``. If Newton's method fails from all starts, the known
        position with the nearest rho is returned.
    """
    by_distance = sorted(positions(rotor), key=lambda x: abs(doubling(rotor, x) - rho))
    if abs(doubling(rotor, by_distance[0]) - rho) <= _SAME:
        return by_distance[0]
    draw = np.random.default_rng(0)
    # Near the ends rho hardly changes along the set, so Newton's method fails from some starts.
    starts = [x + draw.normal(scale=0.05, size=len(x)) for x in by_distance[:4]]
    tries = (_closed(rotor, start, rho) for start in (*by_distance, *starts))
    return next((x for x in tries if x is not None), by_distance[0])


def _balanced_from(rotor: ClosedFormRotor, starts: np.ndarray) -> list[np.ndarray]:
    """Return the balanced positions to which Newton's method converges from starts, shape (m, n).

    Starts from which it fails are skipped.
    """
    return [x for x in (_closed(rotor, start) for start in starts) if x is not None]


def _between(
    rotor: ClosedFormRotor,
    low: np.ndarray,
    high: np.ndarray,
    starts: list[np.ndarray],
    draw: np.random.Generator,
) -> list[np.ndarray]:
    """Return balanced positions from ``low`` to ``high`` at evenly spaced levels of rho.

    Each is searched from the previous one, from ``high`` and from ``starts``; levels that are not
    reached are skipped.
    """
    angles = [low]
    levels = np.linspace(doubling(rotor, low), doubling(rotor, high), _LEVELS)
    for level in levels[1:-1].tolist():
        # Perturb the starts: where rho is extreme its gradient vanishes, and Newton's method has no
        # direction.
        near = [x + draw.normal(scale=0.05, size=len(x)) for x in (angles[-1], high)]
        tries = (_closed(rotor, start, level) for start in (*near, *starts))
        position = next((x for x in tries if x is not None), None)
        angles += [] if position is None else [position]
    return [*angles, high]


def doubling(rotor: ClosedFormRotor, theta: np.ndarray) -> float:
    """Return rho, weighted by m_i R: 1 if all balls are on one line through the shaft."""
    moments = np.array(rotor.moments)
    return float(abs(moments @ np.exp(2j * theta)) / moments.sum())


def _closed(
    rotor: ClosedFormRotor, theta: np.ndarray, level: float | None = None
) -> np.ndarray | None:
    """Return the nearest balanced position by Newton's method, or None if it does not converge.

    Parameters
    ----------
    rotor
        Unbalance and ball moments.
    theta
        Start [rad], shape (n,).
    level
        Value of rho to be met as well; None leaves rho free.
    """
    moments = np.array(rotor.moments)
    total = moments.sum()
    theta = theta.copy()
    for _ in range(60):
        vectors = moments * np.exp(1j * theta)
        miss = vectors.sum() + rotor.unbalance
        residual, rows = (
            [miss.real / total, miss.imag / total],
            [-vectors.imag / total, vectors.real / total],
        )
        if level is not None:
            double = moments * np.exp(2j * theta) / total
            residual.append(abs(double.sum()) ** 2 - level**2)
            rows.append(2.0 * (double.sum().conj() * 2j * double).real)
        if np.abs(residual).max() <= 4e-16 * len(moments):
            break
        # The system is underdetermined: the least-squares step of minimal norm leads to the nearest
        # position. Steps are limited to half a radian.
        step = np.linalg.lstsq(np.array(rows), np.array(residual), rcond=1e-12)[0]
        theta -= step * min(1.0, 0.5 / max(np.abs(step).max(), 1e-300))
    return theta if np.abs(residual).max() <= 1e-13 * len(moments) else None


def _extreme(rotor: ClosedFormRotor, start: np.ndarray, sense: float) -> np.ndarray | None:
    """Return a balanced position at which rho has a local minimum (sense 1) or maximum (-1)."""
    moments = np.array(rotor.moments) / sum(rotor.moments)
    unbalance = rotor.unbalance / sum(rotor.moments)

    def square(theta: np.ndarray) -> float:
        return sense * float(abs(np.sum(moments * np.exp(2j * theta))) ** 2)

    def slope(theta: np.ndarray) -> np.ndarray:
        double = moments * np.exp(2j * theta)
        return sense * 2.0 * (double.sum().conj() * 2j * double).real

    def miss(theta: np.ndarray) -> np.ndarray:
        whole = (moments * np.exp(1j * theta)).sum() + unbalance
        return np.array([whole.real, whole.imag])

    def ways(theta: np.ndarray) -> np.ndarray:
        return np.array([-moments * np.sin(theta), moments * np.cos(theta)])

    closing: Any = {"type": "eq", "fun": miss, "jac": ways}
    options: Any = {"maxiter": 200, "ftol": 1e-14}
    minimum = minimize(
        square, start, jac=slope, method="SLSQP", constraints=[closing], options=options
    )
    # SLSQP satisfies the constraint only approximately: improve the position to rounding.
    return _closed(rotor, minimum.x)


_GROWTH_LEVELS = 33
"""Number of levels of rho between which the extremes of the growth rate are bracketed."""
_NARROW = 1e-9
"""Width of the range of rho up to which all balanced positions count as alike."""
CLOSE = 1e-8
"""Tolerance of the rho of the best and worst position, as a fraction of the range of rho."""

ALL, SAMPLED = "all", "sampled"
"""Sets of balanced positions from which worst and best are chosen; see ``known_positions``."""
Growth = Callable[[np.ndarray], np.ndarray]
"""Function that returns the growth rates [1/s] at values of rho; both have shape (levels,)."""


def known_positions(rotor: ClosedFormRotor | None, balls: int) -> str | None:
    """Return the set of positions among which worst and best are known: ``ALL`` or ``SAMPLED``.

    Parameters
    ----------
    rotor
        Rotor of a ``resting_system``; None if states are found numerically.
    balls
        Number of balls.

    Returns
    -------
    str | None
        ``ALL`` or ``SAMPLED``; None for fewer than three balls, which have one position apart from
        its mirror image.
    """
    if balls < 3:
        return None
    return ALL if rotor is not None and len({*rotor.kinds}) == 1 else SAMPLED


def positions_at(system: System, rotor: ClosedFormRotor, speed: float) -> list[np.ndarray]:
    """Return balanced positions [rad] that include the worst and the best at a nonzero speed.

    Parameters
    ----------
    system
        Result of ``resting_system``.
    rotor
        Closed-form parameters of the system.
    speed
        Spindle speed w [rad/s].

    Returns
    -------
    list[np.ndarray]
        For three or more equal balls: the symmetric position, the worst and the best of all.
        Otherwise all ``positions``, which are a sample if three or more balls differ.
    """
    middle = symmetric(rotor)
    if middle is None or len(middle) < 3:
        return [*positions(rotor)]
    low, high = ends(rotor)
    first, last = doubling(rotor, low), doubling(rotor, high)
    if last - first <= _NARROW:
        return [middle]
    growth, levels = growths(system, speed, low), np.linspace(first, last, _GROWTH_LEVELS)
    samples = growth(levels)
    worst = _least(lambda rhos: -growth(rhos), levels, -samples)
    best = _least(growth, levels, samples)
    return [middle, _position_at(rotor, worst), _position_at(rotor, best)]


def _least(growth: Growth, levels: np.ndarray, samples: np.ndarray) -> float:
    """Return the rho at which a function is smallest, refined around each minimum of its samples.

    Parameters
    ----------
    growth
        Function of rho.
    levels
        Rising values of rho, shape (levels,).
    samples
        Values of the function at ``levels``.
    """
    around = np.pad(samples, 1, constant_values=np.inf)
    low = np.flatnonzero((samples <= around[:-2]) & (samples <= around[2:]))
    close = CLOSE * (levels[-1] - levels[0])
    best = int(samples.argmin())
    rho, least = float(levels[best]), float(samples[best])
    at_ends = growth(np.array([levels[0] + close, levels[-1] - close]))
    for k in low.tolist():
        if k in (0, len(levels) - 1) and samples[k] <= at_ends[min(k, 1)]:
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

    The equations are reduced once, at the position ``theta``, as the module's docstring derives.
    For other values of rho only the coupling of balls and deck is scaled.

    Parameters
    ----------
    system
        Result of ``resting_system`` of equal balls in an isotropic suspension.
    speed
        Spindle speed w [rad/s], not 0.
    theta
        Any balanced position with rho < 1.
    """
    layout, n = layout_of(system), len(theta)
    mass, moment = system.deck_model.total_mass, float(system.balls[0, MOMENT])
    inertia = float(system.balls[0, ROLLING_MASS] * system.balls[0, RACE_RADIUS] ** 2)
    tangents = np.array([-np.sin(theta), np.cos(theta)])
    turn, coupling, along = np.linalg.svd(tangents)
    basis = np.zeros((layout.size, 8))
    basis[layout.deck, :4] = np.kron(np.eye(2), turn)
    basis[layout.angles, 4:6], basis[layout.rates, 6:] = along[:2].T, along[:2].T
    jacobian = field_at(system, speed).jacobian(0.0, state_of(system, speed, np.zeros(2), theta))
    across = along[2:].T if n > 2 else np.zeros((n, 0))
    # Damping of a single ball, taken from a motion that does not act on the deck.
    alone = across[:, 0] @ jacobian[layout.rates, layout.rates] @ across[:, 0]

    def masses(couplings: np.ndarray) -> np.ndarray:
        matrix = np.empty((*couplings.shape[:-1], 8, 8))
        matrix[:] = np.eye(8)
        for axis in (0, 1):
            matrix[..., 2 + axis, 2 + axis] = mass
            matrix[..., 2 + axis, 6 + axis] = moment * couplings[..., axis]
            matrix[..., 6 + axis, 2 + axis] = moment / inertia * couplings[..., axis]
        return matrix

    # The mass matrix on the left: S then multiplies entries instead of being inside an inverse.
    here = masses(coupling) @ (basis.T @ jacobian @ basis)
    block = np.zeros((8, 8))
    block[4:6, 6:] = np.eye(2)
    block[6:, 6:] = alone * np.eye(2)

    def at(rhos: np.ndarray) -> np.ndarray:
        couplings = np.sqrt(0.5 * n * (1.0 + np.multiply.outer(rhos, [1.0, -1.0])).clip(0.0))
        scales = np.ones((len(rhos), 8))
        scales[:, 4:6] = scales[:, 6:] = couplings / coupling
        scaled = block + (here - block) * scales[:, :, None] * scales[:, None, :]
        matrices = np.linalg.solve(masses(couplings), scaled)
        return np.linalg.eigvals(matrices).real.max(axis=1)

    return at

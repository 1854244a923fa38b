"""The balanced set: ball positions whose unbalance cancels the rotor's, so that W is 0.

The sum of m_i R exp(i theta_i) is -M0 e: three-ball (25)-(36), relative-stability (23), (24). One
or two balls have one way to do it, or two that mirror each other; n >= 3 have a manifold of
dimension n - 2.

Of equal balls only one number of a position enters the eigenvalues: a disturbance of the angles,
d_i, reaches the deck as q = sum t_i d_i and comes back through T = sum t_i t_i^T, whose
eigenvalues are n (1 +- rho) / 2, rho = |sum exp(2 i theta_i)| / n; which way T points does not
matter to a deck in an isotropic suspension. So all positions are seen by going through rho
(``extremes``).
"""

import math
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import minimize

from ab_sim.analysis.equilibria.resting import ClosedFormRotor
from ab_sim.drive import balance

LEVELS = 17
"""Of rho, from its smallest to its largest."""
STARTS = 36
"""Per ball, at random, from which these two are looked for; at least two."""
SCATTER = 48
"""Positions at random besides, of balls that differ."""
SAME = 1e-12
"""Values of rho this near to each other are one."""


def can_balance(rotor: ClosedFormRotor) -> bool:
    """Whether balls can cancel the unbalance: the vectors close to a polygon."""
    return balance.can_balance(rotor.unbalance, rotor.moments)


def symmetric(rotor: ClosedFormRotor) -> np.ndarray | None:
    """The balanced position that is its own mirror image, of equal balls; None of others.

    Pairs at +-beta, and of an odd number the last one at pi.
    """
    n = len(rotor.moments)
    if n == 0 or len({*rotor.kinds}) > 1 or not can_balance(rotor):
        return None
    need = rotor.unbalance / rotor.moments[0]
    if n == 1:
        return np.array([math.pi])
    odd = n % 2
    beta = balance.acos_of((odd - need) / (n - odd))
    return np.array([-beta, beta] * (n // 2) + [math.pi] * odd)


def completed(rotor: ClosedFormRotor, given: np.ndarray) -> np.ndarray | None:
    """``balance.completed``, of a rotor."""
    return balance.completed(rotor.unbalance, rotor.moments, given)


def positions(rotor: ClosedFormRotor) -> np.ndarray:
    """Balanced positions from one end of the set to the other, shape (some, n).

    The first is ``symmetric`` where there is such a one. Of one ball and of two there is one
    position, but for its mirror image.
    """
    if not can_balance(rotor) or not rotor.moments:
        return np.empty((0, len(rotor.moments)))
    return _positions(rotor.unbalance, rotor.moments, rotor.kinds)


@lru_cache(maxsize=64)
def _positions(unbalance: float, moments: tuple[float, ...], kinds: tuple[int, ...]) -> np.ndarray:
    rotor = ClosedFormRotor(1.0, unbalance, 0.0, 0.0, 0.0, moments, kinds)
    n, middle = len(moments), symmetric(rotor)
    if n <= 2:
        return np.array([completed(rotor, np.empty(0)) if middle is None else middle])
    starts, low, high = _ends(unbalance, moments, kinds)
    draw = np.random.default_rng(0)
    found = [] if middle is None else [middle]
    found += _between(rotor, low, high, starts, draw)
    if len({*kinds}) > 1:
        found += _there(rotor, draw.uniform(-math.pi, math.pi, (SCATTER, n)))
    return np.array(found)


def ends(rotor: ClosedFormRotor) -> tuple[np.ndarray, np.ndarray]:
    """Balanced positions of three and more balls with the smallest and the largest rho."""
    _, low, high = _ends(rotor.unbalance, rotor.moments, rotor.kinds)
    return low, high


@lru_cache(maxsize=64)
def _ends(
    unbalance: float, moments: tuple[float, ...], kinds: tuple[int, ...]
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Some positions, and the two ends of the set."""
    rotor = ClosedFormRotor(1.0, unbalance, 0.0, 0.0, 0.0, moments, kinds)
    n, middle = len(moments), symmetric(rotor)
    draw = np.random.default_rng(0)
    starts = [] if middle is None else [middle]
    starts += _there(rotor, draw.uniform(-math.pi, math.pi, (max(2, STARTS // n), n)))
    found = [_extreme(rotor, start, sense) for start in starts for sense in (1.0, -1.0)]
    sound = [x for x in found if x is not None] or starts
    sound.sort(key=lambda x: doubling(rotor, x))
    return starts, sound[0], sound[-1]


def position_at(rotor: ClosedFormRotor, rho: float) -> np.ndarray:
    """A balanced position of three and more balls with a rho between those of the ``ends``."""
    known = sorted(positions(rotor), key=lambda x: abs(doubling(rotor, x) - rho))
    if abs(doubling(rotor, known[0]) - rho) <= SAME:
        return known[0]
    draw = np.random.default_rng(0)
    # Beside the ends, where rho hardly changes along the set, some starts lead nowhere.
    starts = [x + draw.normal(scale=0.05, size=len(x)) for x in known[:4]]
    tries = (_closed(rotor, start, rho) for start in (*known, *starts))
    return next((x for x in tries if x is not None), known[0])


def _there(rotor: ClosedFormRotor, starts: np.ndarray) -> list[np.ndarray]:
    """Balanced positions near others, where there are."""
    return [x for x in (_closed(rotor, start) for start in starts) if x is not None]


def _between(
    rotor: ClosedFormRotor,
    low: np.ndarray,
    high: np.ndarray,
    starts: list[np.ndarray],
    draw: np.random.Generator,
) -> list[np.ndarray]:
    """Positions from one to another, at evenly spaced levels of rho."""
    found = [low]
    levels = np.linspace(doubling(rotor, low), doubling(rotor, high), LEVELS)
    for level in levels[1:-1].tolist():
        # A little aside: where rho is extreme, nothing says which way it rises.
        near = [x + draw.normal(scale=0.05, size=len(x)) for x in (found[-1], high)]
        tries = (_closed(rotor, start, level) for start in (*near, *starts))
        there = next((x for x in tries if x is not None), None)
        found += [] if there is None else [there]
    return [*found, high]


def doubling(rotor: ClosedFormRotor, theta: np.ndarray) -> float:
    """rho, of balls that differ weighed by m_i R: 1 where all are on one line through the shaft."""
    moments = np.array(rotor.moments)
    return float(abs(moments @ np.exp(2j * theta)) / moments.sum())


def _closed(
    rotor: ClosedFormRotor, theta: np.ndarray, level: float | None = None
) -> np.ndarray | None:
    """The nearest balanced position, by Newton's method; with a level, at that rho."""
    moments = np.array(rotor.moments)
    total = moments.sum()
    theta = theta.copy()
    for _ in range(60):
        reach = moments * np.exp(1j * theta)
        miss = reach.sum() + rotor.unbalance
        off, ways = (
            [miss.real / total, miss.imag / total],
            [-reach.imag / total, reach.real / total],
        )
        if level is not None:
            double = moments * np.exp(2j * theta) / total
            off.append(abs(double.sum()) ** 2 - level**2)
            ways.append(2.0 * (double.sum().conj() * 2j * double).real)
        if np.abs(off).max() <= 4e-16 * len(moments):
            break
        step = np.linalg.lstsq(np.array(ways), np.array(off), rcond=1e-12)[0]
        theta -= step * min(1.0, 0.5 / max(np.abs(step).max(), 1e-300))
    return theta if np.abs(off).max() <= 1e-13 * len(moments) else None


def _extreme(rotor: ClosedFormRotor, start: np.ndarray, sense: float) -> np.ndarray | None:
    """A balanced position where rho is smallest (sense 1) or largest (-1) nearby."""
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
    found = minimize(
        square, start, jac=slope, method="SLSQP", constraints=[closing], options=options
    )
    return _closed(rotor, found.x)

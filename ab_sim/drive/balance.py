"""Ball positions that balance a rotor, in closed form from the unbalance M0 e and the balls' m_i R.

Condition: the sum of m_i R exp(i theta_i) is -M0 e; three-ball (25)-(36), relative-stability (23),
(24). One or two balls have one solution, or two that mirror each other; n >= 3 balls have a
manifold of dimension n - 2.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.base.ordered_sum import ordered_dot

BALANCED = 1e-12
"""Relative gap at which the sides of a polygon are taken to close it."""


class Balance(NamedTuple):
    """Positions in which balls balance the rotor, or leave the least unbalance."""

    angles: tuple[float, ...]
    """theta_i [rad], from 0 to 2 pi."""
    residual: float
    """Residual unbalance [kg m]; 0 if the balls balance the rotor."""
    many: bool
    """True if the position is one of a continuum of such positions."""


def resultant(moments: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return the balls' part of the unbalance, sum m_i R exp(i theta_i) [kg m], complex.

    Args:
        moments: m_i R [kg m], shape (balls,).
        angles: theta_i [rad], shape (..., balls).
    """
    return ordered_dot(np.exp(1j * angles), moments)


def can_balance(unbalance: float, moments: Sequence[float]) -> bool:
    """Return whether balls can cancel the unbalance: whether the vectors can close a polygon."""
    sides = [unbalance, *moments]
    longest = max(sides)
    return longest <= (math.fsum(sides) - longest) * (1.0 + BALANCED)


def completed(unbalance: float, moments: Sequence[float], placed: np.ndarray) -> np.ndarray | None:
    """Complete positions whose last n - 2 balls are given; return None if no solution exists.

    The first two balls balance the rest of rotor and given balls: three-ball (27)-(34).

    Args:
        unbalance: M0 e [kg m].
        moments: m_i R of at least two balls [kg m].
        placed: angles of the last n - 2 balls [rad], shape (n - 2,).
    """
    one, two, *rest = moments
    need = -unbalance - complex(resultant(np.array(rest), np.asarray(placed, float)))
    far = abs(need)
    if not abs(one - two) <= far * (1.0 + BALANCED) or far > (one + two) * (1.0 + BALANCED):
        return None
    if far == 0.0:
        return np.array([0.0, math.pi, *placed])
    middle = math.atan2(need.imag, need.real)
    aside_1 = acos_of((far * far + one * one - two * two) / (2.0 * far * one))
    aside_2 = acos_of((far * far + two * two - one * one) / (2.0 * far * two))
    return np.array([middle - aside_1, middle + aside_2, *placed])


def acos_of(x: float) -> float:
    """Return the arc cosine, exactly 0 or pi if x is 1 or -1 apart from rounding."""
    if 1.0 - abs(x) <= BALANCED:
        return 0.0 if x > 0.0 else math.pi
    return math.acos(x)


def balance_of(unbalance: float, moments: Sequence[float]) -> Balance | None:
    """Return positions that balance the rotor or leave the least unbalance; None without balls.

    The lighter balls are put in line with the unbalance, each on the side that brings the remaining
    unbalance nearer to m_1 R of the heaviest ball. The two heaviest balls then cancel the
    remainder. No other ball is heavier than the second, so the remainder cannot jump past the range
    of these two.

    Args:
        unbalance: M0 e [kg m], at least 0.
        moments: m_i R of each ball [kg m], above 0.
    """
    if not moments:
        return None
    order = sorted(range(len(moments)), key=lambda ball: -moments[ball])
    heaviest, rest = moments[order[0]], unbalance
    sides = []
    for ball in order[2:]:
        away = rest > heaviest
        rest += -moments[ball] if away else moments[ball]
        sides.append(math.pi if away else 0.0)
    angles = np.full(len(moments), math.pi)
    placed = None
    if len(moments) > 1 and can_balance(unbalance, moments):
        placed = completed(unbalance, [moments[ball] for ball in order], np.array(sides))
    if placed is not None:
        angles[order] = np.remainder(placed, 2.0 * math.pi)
        residual = 0.0
    else:
        if heaviest > unbalance:
            angles[order[1:]] = 0.0
        residual = abs(unbalance + complex(resultant(np.array(moments), angles)))
        residual *= residual > BALANCED * (unbalance + math.fsum(moments))
    many = unbalance == 0.0 or (residual == 0.0 and len(moments) > 2)
    return Balance(tuple(angles.tolist()), residual, many)

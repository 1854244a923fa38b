"""Closed forms that explain a run: positions of balance, driving forces, whirl without balls.

Positions of balance follow from the unbalance M0 e and the balls' m_i R: the sum of m_i R
exp(i theta_i) is -M0 e; three-ball (25)-(36), relative-stability (23), (24). One or two balls have
one solution, or two that mirror each other; n >= 3 balls have a manifold of dimension n - 2.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.base.ordered_sum import ordered_dot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene.model import Scene

BALANCED = 1e-12
"""Gap, relative to the longest side, at which unbalance and ball moments form a closed polygon."""


class Balance(NamedTuple):
    """Positions in which balls balance the rotor, or leave the least unbalance."""

    angles: tuple[float, ...]
    """Ball angles theta_i from the unbalance [rad], from 0 to 2 pi."""
    residual: float
    """Residual unbalance [kg m]; 0 if the balls balance the rotor."""
    many: bool
    """True if the position is one of a continuum of equally good positions."""


def resultant(moments: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return the balls' part of the unbalance, sum m_i R exp(i theta_i) [kg m], complex.

    Parameters
    ----------
    moments
        m_i R [kg m], shape (balls,).
    angles
        theta_i [rad], shape (..., balls).
    """
    return ordered_dot(np.exp(1j * angles), moments)


def can_balance(unbalance: float, moments: Sequence[float]) -> bool:
    """Return whether balls can cancel an unbalance: whether the vectors can close a polygon.

    They can if the longest side is at most the sum of all others.

    Parameters
    ----------
    unbalance
        M0 e [kg m].
    moments
        m_i R of each ball [kg m].
    """
    sides = [unbalance, *moments]
    longest = max(sides)
    return longest <= (math.fsum(sides) - longest) * (1.0 + BALANCED)


def completed(unbalance: float, moments: Sequence[float], placed: np.ndarray) -> np.ndarray | None:
    """Complete positions whose last n - 2 balls are given; return None if no solution exists.

    The first two balls balance the rest of rotor and given balls: three-ball (27)-(34).

    Parameters
    ----------
    unbalance
        M0 e [kg m].
    moments
        m_i R of at least two balls [kg m].
    placed
        Angles of the last n - 2 balls [rad], shape (n - 2,).
    """
    one, two, *rest = moments
    need = -unbalance - complex(resultant(np.array(rest), np.asarray(placed, float)))
    far = abs(need)
    if not abs(one - two) <= far * (1.0 + BALANCED) or far > (one + two) * (1.0 + BALANCED):
        return None
    if far == 0.0:
        return np.array([0.0, math.pi, *placed])
    # Both balls' vectors and the vector ``need`` form a triangle. The law of cosines gives the
    # angles between ``need`` and the two others.
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

    Parameters
    ----------
    unbalance
        M0 e [kg m], at least 0.
    moments
        m_i R of each ball [kg m], above 0.
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


class DrivenBalls(NamedTuple):
    """Parameters of balls and race on which the driving force depends."""

    masses: tuple[float, ...]
    """Ball masses m_i [kg]."""
    friction: tuple[float, ...]
    """Friction coefficients mu of the balls; beta_b/a if they roll (beta_b is a length)."""
    heights: tuple[float, ...]
    """Heights of the balls' races above C [m]; unused in the plane."""
    race_radius: float
    """Race radius R [m]."""

    @classmethod
    def of(cls, scene: Scene) -> "DrivenBalls":
        """Return the parameters that a scene's balls and race have."""
        effects, balls = tuple(scene.effects.values()), scene.balls
        ball_list = map(Ball, balls.masses, balls.radii)
        return cls(
            balls.masses,
            tuple(
                float(over_effects(effects, "friction_coefficient", 0.0, ball))
                for ball in ball_list
            ),
            tuple(scene.race.heights[race] for race in balls.races),
            scene.race.radius,
        )

    def forces(self, trajectory: Trajectory) -> np.ndarray:
        """Return the driving force on each ball [N], shape (samples, balls): thesis (2-15), signed.

        For a deck in space, the displacement is that of the centre of the ball's race, on deck
        axes.
        """
        centre = _race_centres(trajectory, self.heights)
        return self.force(
            centre[..., 0],
            centre[..., 1],
            trajectory["angle"][:, None] + trajectory.ball_angles,
            trajectory["speed"][:, None] + trajectory.ball_rates,
        )

    def force(
        self, x: np.ndarray, y: np.ndarray, angle: np.ndarray, speed: np.ndarray
    ) -> np.ndarray:
        """Return the driving force on balls [N], shape (samples, balls); arguments broadcast to it.

        Positive is the thesis' forward direction, towards -180 deg, of *decreasing* theta. As a
        force along the race in the direction of increasing theta it is -f_d,i.

        f_d,i = m psi_i'^2 (W sin gamma_i - mu (R - W cos gamma_i)) with gamma_i = pi + phi -
        theta_i (thesis (2-15), (2-16), whose phi is the lag, -phi here), *signed*. The thesis
        prints abs(sin gamma), but the values in its figures are those of the first forward peak of
        the signed form.

        Parameters
        ----------
        x, y
            Displacement of the race's centre [m]; in the plane, of the deck on inertial axes.
        angle
            Angles psi_i of the balls on the same axes [rad].
        speed
            Absolute speeds psi_i' of the balls [rad/s].
        """
        # sin gamma = sin(psi_i - delta), cos gamma = -cos(psi_i - delta), delta the whirl's
        # direction.
        sine, cosine = np.sin(angle), np.cos(angle)
        across, along = x * sine - y * cosine, x * cosine + y * sine
        masses, friction = np.array(self.masses), np.array(self.friction)
        return np.asarray(masses * speed**2 * (across - friction * (self.race_radius + along)))


def driving_forces(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Return the driving force on each ball of a scene's run [N], shape (samples, balls)."""
    return DrivenBalls.of(scene).forces(trajectory)


def _race_centres(trajectory: Trajectory, heights: tuple[float, ...]) -> np.ndarray:
    """Return the displacement of each ball's race [m], shape (samples, balls, 2 or 3)."""
    place = trajectory.position[:, None, :]
    if not trajectory.tilts:
        return place
    lift = np.zeros((len(heights), 3))
    lift[:, 2] = heights
    # The transposed matrix turns from inertial axes to deck axes.
    to_deck = trajectory.turned.swapaxes(1, 2)[:, None]
    return ordered_dot(to_deck, (place - lift)[:, :, None]) + lift


class RotorWithoutBalls(NamedTuple):
    """Rotor and deck on a linear, isotropic suspension, in the plane of the disc."""

    mass: float
    """Mass M - sum m_i, without the balls [kg]."""
    unbalance: float
    """Unbalance M0 e [kg m]."""
    stiffness: float
    """Stiffness k [N/m]; 0 without a suspension."""
    damping: float
    """Damping c [N s/m]."""

    def whirl(self, speed: np.ndarray) -> np.ndarray:
        """Return the steady whirl W [m] at speeds [rad/s]: M0 e w^2 / |k - M w^2 + i c w|.

        Thesis (2-9), (2-10) without balls, at rest on the rotating axes. Infinite at the critical
        speed of a suspension without damping.
        """
        square = np.square(speed)
        pull = self.unbalance * square
        hold = np.hypot(self.stiffness - self.mass * square, self.damping * speed)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(pull == 0.0, 0.0, pull / hold)


class WhirlWithoutBalls:
    """Whirl without balls along the speed of a run, from rest at its first sample.

    On axes that turn with the rotor the displacement u changes slowly: ``M (u'' + 2 i w u' + (i w'
    - w^2) u) + c (u' + i w u) + k u = M0 e (w^2 - i w')``. Each step takes the mean speed and
    acceleration as constant and is exact for them. Steps of 10 ms are within 0.2 % of the peak of a
    simulation.

    Parameters
    ----------
    rotor
        The drive without balls.
    """

    def __init__(self, rotor: RotorWithoutBalls) -> None:
        self._rotor = rotor
        self._state = np.array([0.0, 0.0, 1.0], dtype=complex)  # u, u', 1
        self._last: tuple[float, float] | None = None

    def along(self, time: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Return the whirl W [m] at the next times [s] of a run with these speeds [rad/s].

        The whirl is NaN from the first speed on that is not finite.
        """
        speed = np.where(np.isfinite(speed), speed, np.nan)
        if self._last is None:
            self._last = float(time[0]), float(speed[0])
        length = np.diff(time, prepend=self._last[0])
        change = np.diff(speed, prepend=self._last[1])
        self._last = float(time[-1]), float(speed[-1])
        mean = speed - 0.5 * change
        slope = np.divide(change, length, out=np.zeros_like(change), where=length > 0.0)
        mass, unbalance, stiffness, damping = self._rotor
        rates = np.zeros((len(time), 3, 3), dtype=complex)
        rates[:, 0, 1] = 1.0
        push = mean**2 - 1j * slope
        rates[:, 1, 0] = push - (stiffness + 1j * damping * mean) / mass
        rates[:, 1, 1] = -damping / mass - 2j * mean
        rates[:, 1, 2] = unbalance / mass * push
        whirl = np.empty(len(time))
        for row, step in enumerate(_exponentials(rates * length[:, None, None])):
            self._state = step @ self._state
            whirl[row] = abs(self._state[0])
        return whirl


def _exponentials(matrices: np.ndarray) -> np.ndarray:
    """Return the exponentials of matrices, shape (rows, n, n), by scaling and squaring.

    The relative error is 1e-11. All rows are computed at once, in about 7 us each;
    ``scipy.linalg.expm`` takes 1 ms.
    """
    size = np.fmax.reduce(np.abs(matrices).sum(axis=2), axis=None, initial=1.0)
    # At least 16, which suffices for all usual steps, so that the bits do not depend on the rows.
    halvings = max(int(np.ceil(np.log2(size))) + 1, 16)
    scaled = matrices / 2.0**halvings
    # The row sums of ``scaled`` are at most 1/2, so the series after 12 terms leaves less than
    # 0.5^13 / 13! = 2e-14. Squaring amplifies this and rounding.
    total = term = np.broadcast_to(np.eye(matrices.shape[1], dtype=complex), matrices.shape)
    for order in range(1, 13):
        term = term @ scaled / order
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total

"""Closed forms of a sizing: balls that fit into a race, and their settling time from growth rates.

Balls that roll on a wall of radius r have their centres at R = r - a. Point masses opposite U would
just balance it with n m R = U. Balls have a width, and side by side in a row they only reach

    m R sin(n d / 2) / sin(d / 2),    sin(d / 2) = a / R,

where d is the angle from a ball to the next.

Near a balanced position, with the deck's z on the rotor's axes, d = d/dt and tangents t_j of the
balls:

    (M (d + i w)^2 + c (d + i w) + k) z + m R (d + i w)^2 sum t_j x_j = 0
    mu R x_j'' + c_b R x_j' + m t_j . (d + i w)^2 z = 0.

The position enters only through the singular values of the t_j, sqrt(n (1 +- rho) / 2) with rho =
|sum exp(2 i theta_j)| / n: two motions of the balls couple with the deck. They have eight
eigenvalues, the slowest of which determines the time.

The time is an estimate instead of a closed form. First the drag alone reduces the balls' slip from
at most w to the slowest rate. Then the unbalance decays exponentially, from all balls on its own
side to the allowed residual. ``LEAVING`` is added for balls that must first leave that side. The
rate of this decay is that of two motions which are both coupled like the better coupled one. The
slowest motion decays from the unbalance of one radian: with rho near 1 it is slow but causes little
unbalance.

Source: own derivation, from the equations of docs/equations.md, section 1; docs/howto/size.md
compares it with runs.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.circulating import BunchDrive
from ab_sim.design.sizing.specification import DriveSpecification

_LIGHTEST = 1e-9
"""Lightest ball in the search, relative to the largest ball's mass."""
_LOOKS = 400
"""Number of masses in the search."""


@dataclass(frozen=True)
class FittingBalls:
    """Equal balls on a race."""

    count: int
    """Number of balls n."""
    mass: float
    """Mass m of one ball [kg]."""
    radius: float
    """Ball radius a [m]."""
    path_radius: float
    """Radius R of the circle of the balls' centres [m]."""

    @property
    def moment(self) -> float:
        """Moment n m R [kg m]: the unbalance that point masses could balance."""
        return self.count * self.mass * self.path_radius

    @property
    def in_a_row(self) -> float:
        """Largest unbalance that the balls balance, side by side [kg m]."""
        half = math.asin(min(self.radius / self.path_radius, 1.0))
        return self.mass * self.path_radius * math.sin(self.count * half) / math.sin(half)

    @property
    def rolling_mass(self) -> float:
        """Effective mass m + I/a^2 of a rolling solid ball [kg]."""
        return 1.4 * self.mass


def balls_of(count: int, mass: float, specification: DriveSpecification) -> FittingBalls:
    """Return ``count`` balls of a mass [kg] each on the race, without a check that they fit."""
    radius = ball_radius(mass, specification.density)
    return FittingBalls(count, mass, radius, specification.race_radius - radius)


def ball_radius(mass: float, density: float) -> float:
    """Return the radius of a ball [m] from its mass [kg] and density [kg/m^3]."""
    return (3.0 * mass / (4.0 * math.pi * density)) ** (1.0 / 3.0)


def largest_ball(count: int, specification: DriveSpecification) -> float:
    """Return the mass of one of ``count`` balls that just fit the race [kg].

    The race's width or its circumference limits their size.
    """
    sine = math.sin(math.pi / count)
    around = specification.race_radius * sine / (1.0 + sine)
    radius = min(0.5 * specification.race_width, around)
    return 4.0 / 3.0 * math.pi * specification.density * radius**3


def least_mass(count: int, unbalance: float, specification: DriveSpecification) -> float | None:
    """Return the least ball mass [kg] that balances an unbalance side by side, or None.

    None if no such balls fit.

    Parameters
    ----------
    count
        Number of balls n.
    unbalance
        Unbalance U [kg m].
    specification
        Specification with race and density.
    """
    most = largest_ball(count, specification)

    def excess(mass: float) -> float:
        return balls_of(count, mass, specification).in_a_row / unbalance - 1.0

    # The moment rises with the mass, but may fall again when a row of large balls covers half the
    # race: take the first crossing.
    masses = np.geomspace(_LIGHTEST * most, most, _LOOKS)
    enough = [k for k, mass in enumerate(masses.tolist()) if excess(mass) >= 0.0]
    if not enough:
        return None
    if enough[0] == 0:
        return float(masses[0])
    low, high = float(masses[enough[0] - 1]), float(masses[enough[0]])
    return float(brentq(excess, low, high, xtol=1e-14 * most, rtol=1e-13))


LEAVING = 1.0
"""Time for balls to leave the unbalance's side, in time constants of their motion.

Below the critical speed balls gather on that side.
"""
DRAWS = 64
"""Number of rotors and positions for a share."""
STEPS = 200
"""Number of steps from a random start to a balanced position."""
_FARTHEST = 0.3
"""Largest change of a ball angle in a step [rad]."""


class BalancedPlaces(NamedTuple):
    """Rotors from the range of unbalance, with random balanced positions."""

    unbalances: np.ndarray
    """Unbalances [kg m], shape (draws,)."""
    rhos: np.ndarray
    """Values of rho of the balls' positions, shape (draws,)."""


def drive_of_balls(
    balls: FittingBalls, specification: DriveSpecification, drag: float
) -> BunchDrive:
    """Return the closed-form parameters of a drive with these balls.

    Parameters
    ----------
    balls, specification
        Balls and drive.
    drag
        Drag c_b on a ball [N s/m].
    """
    return BunchDrive(
        mass=specification.mass + balls.count * balls.mass,
        unbalance=specification.largest_unbalance,
        stiffness=specification.stiffness,
        damping=specification.damping,
        radius=balls.path_radius,
        drag=drag,
        ball_mass=balls.mass,
        rolling_mass=balls.rolling_mass,
        balls=balls.count,
    )


def balanced_places(balls: FittingBalls, specification: DriveSpecification) -> BalancedPlaces:
    """Return balanced positions, reached from random starts by minimal-norm steps.

    Unbalances are evenly spaced in their range and start angles are random. Both are equal for all
    drives with the same number of balls.
    """
    low, high = specification.least_unbalance, specification.largest_unbalance
    unbalances = low + (high - low) * (np.arange(DRAWS) + 0.5) / DRAWS
    draw = np.random.default_rng(balls.count)
    theta = draw.uniform(-math.pi, math.pi, (DRAWS, balls.count))
    moment = balls.mass * balls.path_radius
    # Damped Gauss-Newton (Levenberg 1944): the small multiple of the identity bounds the step where
    # all balls are nearly on one line and the two equations depend on each other.
    small = 1e-3 * balls.count * moment**2 * np.eye(2)
    for _ in range(STEPS):
        vectors = moment * np.exp(1j * theta)
        residual = vectors.sum(axis=1) + unbalances
        jacobian = np.stack([-vectors.imag, vectors.real], axis=1)
        square = jacobian @ jacobian.transpose(0, 2, 1) + small
        wanted = np.stack([residual.real, residual.imag], axis=1)[..., np.newaxis]
        step = (jacobian.transpose(0, 2, 1) @ np.linalg.solve(square, wanted))[..., 0]
        longest = np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300)
        theta -= step * np.minimum(1.0, _FARTHEST / longest)
    return BalancedPlaces(unbalances, np.abs(np.exp(2j * theta).mean(axis=1)))


def couplings(drive: BunchDrive, rhos: np.ndarray) -> np.ndarray:
    """Return the singular values of the tangents, the larger first, shape (positions, 2).

    Parameters
    ----------
    drive
        Parameters of the drive.
    rhos
        Values of rho of the positions, shape (positions,).
    """
    squares = 0.5 * drive.balls * (1.0 + np.multiply.outer(rhos, [1, -1]))
    return np.sqrt(np.maximum(squares, 0.0))


def largest_growth(drive: BunchDrive, speed: float, coupling: np.ndarray) -> np.ndarray:
    """Return the largest growth rate at balanced positions [1/s], shape (positions,).

    Structural zeros of three or more balls are left out, because nothing moves along a continuum of
    balanced positions.

    Parameters
    ----------
    drive
        Parameters of the drive.
    speed
        Spindle speed w [rad/s].
    coupling
        Couplings of the balls' two motions, see ``couplings``, shape (positions, 2).
    """
    mass, m, w = drive.mass, drive.ball_mass, speed
    one, turn = np.eye(2), np.array([[0.0, -1.0], [1.0, 0.0]])
    S = coupling[..., np.newaxis] * one
    # Matrices of d^2, d and 1 in the module's equations: two rows of the deck, two of the balls.
    second, first, none = (np.zeros((*np.shape(coupling)[:-1], 4, 4)) for _ in range(3))
    second[..., :2, :2], second[..., 2:, 2:] = mass * one, drive.rolling_mass * one
    second[..., :2, 2:] = second[..., 2:, :2] = m * S
    first[..., :2, :2] = drive.damping * one + 2.0 * w * mass * turn
    first[..., :2, 2:], first[..., 2:, :2] = 2.0 * w * m * turn @ S, 2.0 * w * m * S @ turn
    first[..., 2:, 2:] = drive.drag * one
    none[..., :2, :2] = (drive.stiffness - mass * w * w) * one + drive.damping * w * turn
    none[..., :2, 2:] = none[..., 2:, :2] = -m * w * w * S
    inverse = np.linalg.inv(second)
    companion = np.zeros((*np.shape(coupling)[:-1], 8, 8))
    companion[..., :4, 4:] = np.eye(4)
    companion[..., 4:, :4], companion[..., 4:, 4:] = -inverse @ none, -inverse @ first
    growth: np.ndarray = np.linalg.eigvals(companion).real.max(axis=-1)
    return growth


def _settle_times(
    drive: BunchDrive, specification: DriveSpecification, places: BalancedPlaces
) -> np.ndarray:
    """Estimate the time from the running speed until a drive is balanced [s].

    Parameters
    ----------
    drive
        Parameters of the drive.
    specification
        Specification with speed and allowed residual.
    places
        Rotors with balanced positions.

    Returns
    -------
    np.ndarray
        Times, shape (draws,); infinite if the balanced position is unstable.
    """
    speed = specification.speed
    coupling = couplings(drive, places.rhos)
    rate = -largest_growth(drive, speed, coupling)
    slow = np.maximum(rate, 1e-12)
    fast = np.maximum(-largest_growth(drive, speed, coupling[:, [0, 0]]), 1e-12)
    moment, limit = drive.ball_mass * drive.radius, specification.limit
    # Numbers of time constants: of the unbalance from its largest value, and of the slowest motion
    # from one radian, each until the allowed residual.
    slip = drive.rolling_mass / drive.drag * np.log(np.maximum(speed / slow, 1.0))
    decay = np.log(np.maximum((places.unbalances + drive.balls * moment) / limit, 1.0)) + LEAVING
    of_radian = math.sqrt(drive.balls) * moment * coupling[:, 1]
    last = np.log(np.maximum(of_radian / limit, 1.0))
    return np.where(rate > 0.0, slip + np.maximum(decay / fast, last / slow), math.inf)


def stuck(balls: FittingBalls, specification: DriveSpecification) -> tuple[float, float]:
    """Return the whirl [m] below which friction holds balls anywhere, and the unbalance [kg m].

    The deck's whirl W pulls a ball along the race by m w^2 W at most. Rolling friction holds it up
    to (arm / a) m R w^2, that is up to W = R arm / a. At the running speed an unbalance of
    W |k - M w^2 + i c w| / w^2 causes this whirl.
    """
    speed, drive = specification.speed, drive_of_balls(balls, specification, 0.0)
    whirl = balls.path_radius * specification.friction_arm / balls.radius
    resistance = complex(drive.stiffness - drive.mass * speed**2, drive.damping * speed)
    return whirl, whirl * abs(resistance) / speed**2


def share_in_time(
    drive: BunchDrive, specification: DriveSpecification, places: BalancedPlaces
) -> float:
    """Return the share of rotors balanced within ``specification.settle``, by ``_settle_times``."""
    return float(np.mean(_settle_times(drive, specification, places) <= specification.settle))

"""Closed form of balls that circulate in one bunch near the critical speed.

p of n balls are at one place of the race and turn at s < w; the other q = n - p rest on the rotor.
In axes that turn at s the deck is displaced by z > 0, and the bunch is at angle alpha from z. With
b = w - s, the drag torque on the balls balances the torque of their whirl if

    D z = s^2 p m R exp(i alpha),                      p c_b R^2 b = Im D z^2,
    D = k - M s^2 + i c s + q m^2 s^4 / (2 (mu b^2 + i c_b b)),

where the last term is the mean effect of balls on the rotor, which swing with the whirl: it reduces
the deck's inertia. Eliminating z gives a polynomial in s, of degree 5 for q = 0, otherwise 8:

    F(s) = c_b b |D|^2 - p m^2 s^4 Im D = 0.

This is a drive of limited power at a resonance (Sommerfeld effect). There are one or three roots;
the middle one is never stable. The lowest root, below the critical speed, is the stalled bunch. It
vanishes in a fold with the middle one.

Three effects are neglected. First, the unbalance that turns at w (rotor and resting balls), whose
force on the bunch beats at b. Second, higher powers of the swings. Both cause relative errors of
about the squares of ``bunch_swing`` and ``resting_swing``. Third, friction. States with a swing
above ``MOST_SWING`` are outside the validity of the closed form.

Source: own derivation. Sommerfeld effect: Nayfeh and Mook, Nonlinear Oscillations (1979), 4.5.
"""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from ab_sim.analysis.circulating.drive import BunchDrive
from ab_sim.analysis.circulating.growth import growth_rates

MOST_SWING = 0.15
"""Largest swing for which the closed form is valid [rad].

Observed errors of speeds were below its square, 2 %.
"""


@dataclass(frozen=True)
class CirculatingBunch:
    """Balls that turn together at a speed between 0 and the spindle's."""

    drive: BunchDrive
    spindle_speed: float
    """Spindle speed w [rad/s], with its sign."""
    count: int
    """Number p of balls in the bunch, out of ``drive.balls``."""
    speed: float
    """Speed s of the bunch relative to the housing [rad/s], with the sign of w."""
    W: float
    """Radius z of the deck's whirl at s [m]."""
    angle: float
    """Angle alpha by which the bunch leads the displacement [rad]."""

    @property
    def bunch_swing(self) -> float:
        """Amplitude of the bunch's swing at the beat, due to the neglected whirl at w [rad]."""
        drive, w = self.drive, abs(self.spindle_speed)
        pull = w**4 * _turning_unbalance(drive, w, self.count)
        rotor = complex(drive.stiffness - drive.mass * w * w, drive.damping * w)
        return drive.ball_mass * pull / abs(rotor) / self._beaten(abs(self.speed))

    @property
    def resting_swing(self) -> float:
        """Swing of resting balls, due to the whirl at s [rad]; 0 without such balls."""
        if self.count == self.drive.balls:
            return 0.0
        s = abs(self.speed)
        return self.drive.ball_mass * s * s * self.W / self._beaten(s)

    @property
    def known(self) -> bool:
        """True if swings are small enough for the closed form."""
        return max(self.bunch_swing, self.resting_swing) <= MOST_SWING

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """Growth rates of small disturbances [1/s], complex, by falling real part.

        They belong to the averaged equations, without the zero eigenvalue of a shift in time.
        """
        s, w = abs(self.speed), abs(self.spindle_speed)
        return growth_rates(self.drive, w, self.count, s, self.W * cmath.exp(-1j * self.angle))

    @property
    def lambda_max(self) -> float:
        """Largest growth rate [1/s]."""
        return float(self.eigenvalues.real.max())

    @property
    def stable(self) -> bool:
        """True if small disturbances decay, by the averaged equations."""
        return self.lambda_max < 0.0

    def report(self) -> dict[str, object]:
        """Return the bunch as JSON-able values in SI units."""
        return {
            "balls": self.count,
            "speed": self.speed,
            "W": self.W,
            "angle": self.angle,
            "lambda_max": self.lambda_max,
            "stable": self.stable,
            "bunch_swing": self.bunch_swing,
            "resting_swing": self.resting_swing,
        }

    def _beaten(self, s: float) -> float:
        """Return the force per radian of a ball that swings at b [N]."""
        drive, b = self.drive, abs(self.spindle_speed) - s
        return drive.radius * abs(complex(drive.rolling_mass * b * b, drive.drag * b))


def bunches(drive: BunchDrive, speed: float, count: int) -> list[CirculatingBunch]:
    """Return all states with ``count`` circulating balls by rising speed, stable or not.

    Args:
        drive: parameters of the drive.
        speed: spindle speed w [rad/s], either sign.
        count: number p of balls, from 1 to ``drive.balls``.

    Raises:
        ValueError: ``count`` is out of range.
    """
    if not 1 <= count <= drive.balls:
        raise ValueError(f"count = {count}: must be from 1 to {drive.balls}")
    w = abs(speed)
    if w == 0.0:
        return []
    states = []
    for s in _roots(drive, w, count):
        D = _stiffness_at(drive, w, count, s)
        if D.imag <= 0.0:
            continue
        W = s * s * count * drive.ball_mass * drive.radius / abs(D)
        states.append(
            CirculatingBunch(drive, speed, count, math.copysign(s, speed), W, cmath.phase(D))
        )
    return states


def stalled(
    drive: BunchDrive, speed: float, count: int, known_only: bool = True
) -> CirculatingBunch | None:
    """Return the stable state of lowest speed; None if there is none.

    Args:
        drive, speed, count: see ``bunches``.
        known_only: accept only states with small swings. Otherwise also accept plausible states,
            whose bunch is on the side of the displacement, as it is below the critical speed.
    """
    for bunch in bunches(drive, speed, count):
        if bunch.stable and (bunch.known or (not known_only and bunch.angle < 0.5 * math.pi)):
            return bunch
    return None


def _stiffness_at(drive: BunchDrive, w: float, count: int, s: float) -> complex:
    """Return the dynamic stiffness D [N/m]."""
    b, m = w - s, drive.ball_mass
    stiffness = complex(drive.stiffness - drive.mass * s * s, drive.damping * s)
    if count == drive.balls:
        return stiffness
    swinging = complex(drive.rolling_mass * b * b, drive.drag * b)
    return stiffness + (drive.balls - count) * m * m * s**4 / (2.0 * swinging)


def _missed(drive: BunchDrive, w: float, count: int, s: float) -> float:
    """Return F / (c_b w k^2), dimensionless."""
    D = _stiffness_at(drive, w, count, s) / drive.stiffness
    driven = drive.drag * (w - s) * abs(D) ** 2 / (drive.drag * w)
    lost = count * drive.ball_mass**2 * s**4 * D.imag / (drive.stiffness * drive.drag * w)
    return driven - lost


def _roots(drive: BunchDrive, w: float, count: int) -> list[float]:
    """Return all s in (0, w) with F = 0.

    Between two zeros of its derivative, the polynomial has at most one root.
    """
    slope = _polynomial(drive, w, count).deriv()
    # Scaled by the critical speed, at which |D| has its narrow minimum.
    scale = math.sqrt(drive.stiffness / drive.mass)
    turning = np.asarray(slope.roots()).real * scale
    edges = np.unique(np.clip([1e-9 * w, *turning, (1.0 - 1e-9) * w], 1e-9 * w, (1.0 - 1e-9) * w))
    values = [_missed(drive, w, count, float(s)) for s in edges]
    roots = []
    for k in range(len(edges) - 1):
        if values[k] * values[k + 1] < 0.0:
            ends = float(edges[k]), float(edges[k + 1])
            roots.append(
                float(brentq(lambda s: _missed(drive, w, count, s), *ends, xtol=1e-13 * w))
            )
    return roots


def _polynomial(drive: BunchDrive, w: float, count: int) -> Polynomial:
    """Return F as a polynomial in x = s / sqrt(k/M), up to a positive factor."""
    unit = math.sqrt(drive.stiffness / drive.mass)
    x, m = Polynomial([0.0, 1.0]), drive.ball_mass
    b, loss = w / unit - x, drive.damping * unit / drive.stiffness
    drag = drive.drag / (m * unit)
    own_real, own_imag = 1.0 - x**2, loss * x
    q, share = drive.balls - count, m / drive.mass
    if q == 0:
        return drag * b * (own_real**2 + own_imag**2) - count * share * x**4 * own_imag
    # D 2 E b = N with E = mu/m b + i c_b/(m unit), F times 4 b |E|^2.
    E_real = drive.rolling_mass / m * b
    N_real = 2.0 * b * (own_real * E_real - own_imag * drag) + q * share * x**4
    N_imag = 2.0 * b * (own_real * drag + own_imag * E_real)
    turned = N_imag * E_real - N_real * drag
    return drag * (N_real**2 + N_imag**2) - 2.0 * count * share * x**4 * turned


def _turning_unbalance(drive: BunchDrive, w: float, count: int) -> float:
    """Return the unbalance of rotor and resting balls, which turns at w [kg m].

    Above the critical speed the resting balls cancel as much of it as they can; below, they gather
    on the side of the unbalance.
    """
    balls_unbalance = (drive.balls - count) * drive.ball_mass * drive.radius
    if drive.mass * w * w <= drive.stiffness:
        return drive.unbalance + balls_unbalance
    if drive.balls - count >= 2:
        return max(0.0, drive.unbalance - balls_unbalance)
    return abs(drive.unbalance - balls_unbalance)

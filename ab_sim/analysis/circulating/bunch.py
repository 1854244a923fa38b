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

The stability of a bunch follows from equations averaged over the beat. In axes that turn at s, with
complex z of the deck, theta of the bunch, d = d/dt and b = w - s:

    (M (d + i s)^2 + c (d + i s) + k + G(d)) z + p m R (d + i s)^2 exp(i theta) = 0
    mu R theta'' + c_b R (theta' - b) + m Re(-i exp(-i theta) (d + i s)^2 z) = 0
    G(d) = -q m^2/2 (d + i s)^4 / (mu (d - i b)^2 + c_b (d - i b))

G is the effect of balls on the rotor, which swing at b. Three terms of its series in d are kept,
because the disturbances are slow compared with the beat. The stability of the balls on the rotor is
not covered; the test of resting states covers it.

Balls of a bunch may also separate, without effect on the deck. This gives, p - 1 times,

    mu R l^2 + c_b R l + m s^2 Re z = 0 at theta = 0,

which decays if the bunch is on the side of the displacement: for q = 0 up to s^2 = k/M. For q = 0
and without a rotor unbalance the equations are exact.

Source: own derivation, from the equations of docs/equations.md, section 1. Sommerfeld effect:
Nayfeh and Mook, Nonlinear Oscillations (1979), 4.5.
"""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from ab_sim.analysis.equilibria.resting import resting_system, rotor_of
from ab_sim.base.errors import SceneError
from ab_sim.model.dynamics.system import MASS, RACE_RADIUS, RADIUS, ROLLING_MASS, System
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene.model import Scene


class BunchDrive(NamedTuple):
    """Parameters of a planar drive with equal balls in an isotropic linear suspension."""

    mass: float
    """Total mass M, with the balls [kg]."""
    unbalance: float
    """Unbalance M0 e [kg m]."""
    stiffness: float
    """Stiffness k [N/m]."""
    damping: float
    """Damping c [N s/m]."""
    radius: float
    """Race radius R [m]."""
    drag: float
    """Drag on a ball c_b [N s/m]."""
    ball_mass: float
    """Ball mass m [kg]."""
    rolling_mass: float
    """Effective mass mu = m + I/a^2 [kg]; m for balls that do not roll."""
    balls: int
    """Number of balls n."""


def reason_not_covered(scene: Scene) -> str | None:
    """Return the reason why the closed form does not cover a scene; None if it does."""
    drive_or_reason = _known(scene)
    return drive_or_reason if isinstance(drive_or_reason, str) else None


def drive_of(scene: Scene) -> BunchDrive | None:
    """Return the parameters of the closed form for a scene; None if it does not cover the scene."""
    drive_or_reason = _known(scene)
    return None if isinstance(drive_or_reason, str) else drive_or_reason


def _known(scene: Scene) -> BunchDrive | str:
    """Return the parameters of the closed form, or the reason why it does not cover the scene."""
    if scene.balls.count == 0:
        return "there are no balls"
    if "ball_contact" in scene.effects:
        return "effects.ball_contact: balls that touch form a row and no bunch at one place"
    try:
        system = resting_system(scene)
    except SceneError as error:
        return str(error)
    rotor = rotor_of(system)
    if rotor is None:
        return "an effect changes the race or the deck in a way that the closed form does not cover"
    drag, problem = _drag_of(system), None
    if rotor.cubic_stiffness != 0.0:
        problem = "effects.hardening_suspension: the closed form assumes a linear suspension"
    elif len({*rotor.kinds}) > 1:
        problem = "balls.mass: the balls differ"
    elif drag <= 0.0:
        problem = "effects.viscous_drag: without drag nothing drives the balls"
    elif rotor.stiffness <= 0.0 or rotor.damping <= 0.0:
        problem = "effects.suspension: without stiffness or damping nothing holds the balls back"
    if problem is not None:
        return problem
    ball = system.balls[0]
    return BunchDrive(
        mass=rotor.mass,
        unbalance=rotor.unbalance,
        stiffness=rotor.stiffness,
        damping=rotor.damping,
        radius=float(ball[RACE_RADIUS]),
        drag=drag,
        ball_mass=float(ball[MASS]),
        rolling_mass=float(ball[ROLLING_MASS]),
        balls=len(system.balls),
    )


def _drag_of(system: System) -> float:
    """Return the drag c_b on the first ball [N s/m]."""
    ball = Ball(*system.balls[0, [MASS, RADIUS]])
    return float(over_effects(system.effects, "ball_drag", 0.0, ball))


Orders = tuple[complex, complex, complex]
"""Coefficients of d^2, d and 1 in a differential equation, d = d/dt."""


def _growth_rates(drive: "BunchDrive", w: float, count: int, s: float, z: complex) -> np.ndarray:
    """Return the growth rates of small disturbances of a bunch [1/s], by falling real part.

    Parameters
    ----------
    drive
        Parameters of the drive.
    w
        Spindle speed [rad/s], above 0.
    count
        Number p of balls in the bunch.
    s
        Speed of the bunch [rad/s], above 0.
    z
        Displacement of the deck relative to the bunch's direction [m].

    Returns
    -------
    np.ndarray
        Complex rates, shape (5 + 2 (p - 1),), without the zero of a shift in time.
    """
    orders = _equations(drive, w, count, s, z)
    size = len(orders[0])
    inverse = np.linalg.inv(orders[0])
    companion = np.zeros((2 * size, 2 * size))
    companion[:size, size:] = np.eye(size)
    companion[size:, :size], companion[size:, size:] = -inverse @ orders[2], -inverse @ orders[1]
    rates = np.linalg.eigvals(companion)
    # Rotating the whole motion is a shift in time, which neither grows nor decays: drop its zero.
    rates = np.delete(rates, int(np.argmin(np.abs(rates))))
    pull = drive.ball_mass * s * s * z.real / drive.radius
    parting = np.roots([drive.rolling_mass, drive.drag, pull])
    rates = np.concatenate([rates, *[parting] * (count - 1)])
    return np.asarray(rates[np.argsort(-rates.real)], complex)


def _equations(
    drive: "BunchDrive", w: float, count: int, s: float, z: complex
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the averaged equations, linearised: three real matrices of the disturbances.

    Parameters
    ----------
    drive, w, count, s, z
        See ``_growth_rates``.

    Returns
    -------
    tuple[np.ndarray, np.ndarray, np.ndarray]
        Matrices of d^2, d and 1, shape (3, 3) each. They multiply (Re z / R, Im z / R, theta).
    """
    m, mu, cb = drive.ball_mass, drive.rolling_mass, drive.drag
    turned: Orders = 1.0, 2j * s, -s * s
    deck = 0.0, drive.damping, drive.stiffness + 1j * drive.damping * s
    swung = _swinging(drive, w, count, s)
    equations = []
    for order in range(3):
        matrix = np.zeros((3, 3))
        matrix[:2, :2] = _plane(drive.mass * turned[order] + deck[order] + swung[order])
        bunch = 1j * turned[order]
        matrix[:2, 2] = count * m * bunch.real, count * m * bunch.imag
        matrix[2, :2] = m * _plane(-1j * turned[order])[0]
        matrix[2, 2] = (mu, cb, m * s * s * z.real / drive.radius)[order]
        equations.append(matrix)
    return equations[0], equations[1], equations[2]


def _swinging(drive: "BunchDrive", w: float, count: int, s: float) -> Orders:
    """Return the coefficients of d^2, d and 1 in the Taylor series of G(d) about d = 0."""
    b, factor = w - s, -0.5 * (drive.balls - count) * drive.ball_mass**2
    mu, cb = drive.rolling_mass, drive.drag
    # Numerator (d + i s)^4 and denominator of G, up to d^2, then the quotient of the two series.
    above = s**4, 4.0 * (1j * s) ** 3, -6.0 * s * s
    below = complex(-mu * b * b, -cb * b), complex(cb, -2.0 * mu * b), mu
    first = above[0] / below[0]
    second = (above[1] - below[1] * first) / below[0]
    third = (above[2] - below[1] * second - below[2] * first) / below[0]
    return factor * third, factor * second, factor * first


def _plane(factor: complex) -> np.ndarray:
    """Return the real 2 x 2 matrix that multiplies (real, imaginary) by a complex number."""
    return np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])


MOST_SWING = 0.15
"""Largest swing for which the closed form is valid [rad].

Observed errors of speeds were below its square, 2 %.
"""


@dataclass(frozen=True)
class CirculatingBunch:
    """Balls that turn together at a speed between 0 and the spindle's."""

    drive: BunchDrive
    """Parameters of the drive."""
    spindle_speed: float
    """Spindle speed w [rad/s]; negative if the spindle turns backwards."""
    count: int
    """Number p of balls in the bunch; the others rest on the rotor."""
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
        return drive.ball_mass * pull / abs(rotor) / self._swing_stiffness(abs(self.speed))

    @property
    def resting_swing(self) -> float:
        """Swing of resting balls, due to the whirl at s [rad]; 0 without such balls."""
        if self.count == self.drive.balls:
            return 0.0
        s = abs(self.speed)
        return self.drive.ball_mass * s * s * self.W / self._swing_stiffness(s)

    @property
    def valid(self) -> bool:
        """True if ``bunch_swing`` and ``resting_swing`` are small enough for the closed form."""
        return max(self.bunch_swing, self.resting_swing) <= MOST_SWING

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """Growth rates of small disturbances [1/s], complex, by falling real part.

        They belong to the averaged equations, without the zero eigenvalue of a shift in time.
        """
        s, w = abs(self.speed), abs(self.spindle_speed)
        return _growth_rates(self.drive, w, self.count, s, self.W * cmath.exp(-1j * self.angle))

    @property
    def lambda_max(self) -> float:
        """Largest growth rate [1/s]."""
        return float(self.eigenvalues.real.max())

    @property
    def stable(self) -> bool:
        """True if small disturbances decay, by the averaged equations."""
        return self.lambda_max < 0.0

    def report(self) -> dict[str, object]:
        """Return state, stability and swings as JSON-able values in SI units."""
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

    def _swing_stiffness(self, s: float) -> float:
        """Return the amplitude of the force per radian of a ball that swings at b = w - s [N]."""
        drive, b = self.drive, abs(self.spindle_speed) - s
        return drive.radius * abs(complex(drive.rolling_mass * b * b, drive.drag * b))


def bunches(drive: BunchDrive, speed: float, count: int) -> list[CirculatingBunch]:
    """Return all states with ``count`` circulating balls by rising speed s, stable or not.

    Parameters
    ----------
    drive
        Parameters of the drive.
    speed
        Spindle speed w [rad/s], either sign.
    count
        Number p of balls, from 1 to the number of balls.

    Raises
    ------
    ValueError
        ``count`` is out of range.
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
    drive: BunchDrive, speed: float, count: int, valid_only: bool = True
) -> CirculatingBunch | None:
    """Return the stable bunch of lowest speed s; None if there is none.

    Parameters
    ----------
    drive, speed, count
        See ``bunches``.
    valid_only
        Accept only states with small swings. Otherwise also accept plausible states, whose bunch is
        on the side of the displacement, as it is below the critical speed.
    """
    for bunch in bunches(drive, speed, count):
        if bunch.stable and (bunch.valid or (not valid_only and bunch.angle < 0.5 * math.pi)):
            return bunch
    return None


def _stiffness_at(drive: BunchDrive, w: float, count: int, s: float) -> complex:
    """Return the dynamic stiffness D of the deck at the speed s of ``count`` balls [N/m]."""
    b, m = w - s, drive.ball_mass
    stiffness = complex(drive.stiffness - drive.mass * s * s, drive.damping * s)
    if count == drive.balls:
        return stiffness
    swinging = complex(drive.rolling_mass * b * b, drive.drag * b)
    return stiffness + (drive.balls - count) * m * m * s**4 / (2.0 * swinging)


def _residual(drive: BunchDrive, w: float, count: int, s: float) -> float:
    """Return F(s) / (c_b w k^2), dimensionless; it is 0 for a bunch at speed s."""
    D = _stiffness_at(drive, w, count, s) / drive.stiffness
    driven = drive.drag * (w - s) * abs(D) ** 2 / (drive.drag * w)
    lost = count * drive.ball_mass**2 * s**4 * D.imag / (drive.stiffness * drive.drag * w)
    return driven - lost


def _roots(drive: BunchDrive, w: float, count: int) -> list[float]:
    """Return all speeds s in (0, w) with F(s) = 0, rising [rad/s].

    Between two zeros of its derivative, the polynomial has at most one root. F itself is evaluated
    from its factors, because the coefficients of the polynomial lose digits at its narrow minima.
    """
    slope = _polynomial(drive, w, count).deriv()
    # Scaled by the critical speed, at which |D| has its narrow minimum.
    scale = math.sqrt(drive.stiffness / drive.mass)
    turning = np.asarray(slope.roots()).real * scale
    edges = np.unique(np.clip([1e-9 * w, *turning, (1.0 - 1e-9) * w], 1e-9 * w, (1.0 - 1e-9) * w))
    values = [_residual(drive, w, count, float(s)) for s in edges]
    roots = []
    for k in range(len(edges) - 1):
        if values[k] * values[k + 1] < 0.0:
            ends = float(edges[k]), float(edges[k + 1])
            roots.append(
                float(brentq(lambda s: _residual(drive, w, count, s), *ends, xtol=1e-13 * w))
            )
    return roots


def _polynomial(drive: BunchDrive, w: float, count: int) -> Polynomial:
    """Return F as a polynomial in x = s / sqrt(k/M), up to a positive factor."""
    unit = math.sqrt(drive.stiffness / drive.mass)
    x, m = Polynomial([0.0, 1.0]), drive.ball_mass
    b, loss = w / unit - x, drive.damping * unit / drive.stiffness
    drag = drive.drag / (m * unit)
    deck_real, deck_imag = 1.0 - x**2, loss * x
    q, share = drive.balls - count, m / drive.mass
    if q == 0:
        return drag * b * (deck_real**2 + deck_imag**2) - count * share * x**4 * deck_imag
    # D 2 E b = N with E = mu/m b + i c_b/(m unit), F times 4 b |E|^2.
    E_real = drive.rolling_mass / m * b
    N_real = 2.0 * b * (deck_real * E_real - deck_imag * drag) + q * share * x**4
    N_imag = 2.0 * b * (deck_real * drag + deck_imag * E_real)
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

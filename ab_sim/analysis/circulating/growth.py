"""Stability of a circulating bunch, by equations averaged over the beat.

In axes that turn at s, with complex z of the deck, theta of the bunch, d = d/dt and b = w - s:

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

Source: own derivation, from the equations of docs/equations.md, section 1.
"""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ab_sim.analysis.circulating.drive import BunchDrive

Orders = tuple[complex, complex, complex]
"""Factors of the second derivative, the first derivative and the function itself."""


def growth_rates(drive: "BunchDrive", w: float, count: int, s: float, z: complex) -> np.ndarray:
    """Return eigenvalues [1/s], complex, by falling real part, without the structural zero.

    Args:
        drive: parameters of the drive.
        w: spindle speed [rad/s], above 0.
        count: number p of balls in the bunch.
        s: speed of the bunch [rad/s].
        z: displacement of the deck [m] in axes that turn at s, with the bunch at angle 0.

    Returns:
        Eigenvalues, shape (5 + 2 (p - 1),).
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
    """Return the real matrices of z and theta for derivatives 2, 1 and 0, with lengths in R."""
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
    """Return the coefficients of d^2, d and 1 in the series of G."""
    b, factor = w - s, -0.5 * (drive.balls - count) * drive.ball_mass**2
    mu, cb = drive.rolling_mass, drive.drag
    above = s**4, 4.0 * (1j * s) ** 3, -6.0 * s * s
    below = complex(-mu * b * b, -cb * b), complex(cb, -2.0 * mu * b), mu
    first = above[0] / below[0]
    second = (above[1] - below[1] * first) / below[0]
    third = (above[2] - below[1] * second - below[2] * first) / below[0]
    return factor * third, factor * second, factor * first


def _plane(factor: complex) -> np.ndarray:
    """Return the real 2x2 matrix of the multiplication by a complex number."""
    return np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])

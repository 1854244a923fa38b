"""The papers' own equations, which are linear in the deck, integrated by SciPy: ours are checked.

(1) and (2) of the paper on the rig: q = (X, phi_Y, Y, -phi_X), f = (M eps exp(i beta),
chi (J_t - J_p)), b_k = m R (1, z_k), A_k = Omega + alpha_k',

    (M + m) q'' + C q' + Omega G q' + K q = Omega^2 (Re, Im)[f exp(i Omega t)]
        + sum of A_k^2 (Re, Im)[b_k exp(i phi_k)] + alpha_k'' (Im, -Re)[b_k exp(i phi_k)]
    m R^2 alpha_k'' + c_b alpha_k'
        = m R ((X'' + z phi_Y'') sin phi_k - (Y'' - z phi_X'') cos phi_k),  phi_k = Omega t + alpha_k
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from gallery.two_plane.rotor import RigidRotor

TOLERANCE = 1e-11


class PrintedRun(NamedTuple):
    """Samples of a run of the papers' equations."""

    time: np.ndarray
    q: np.ndarray
    """X, phi_Y, Y, -phi_X, shape (samples, 4)."""
    angles: np.ndarray
    """alpha_k [rad], shape (samples, balls)."""

    def displacement(self, height: float) -> np.ndarray:
        """X + i Y of the shaft at a height from C [m], shape (samples,)."""
        x, tilt_y, y, tilt_x = self.q.T
        return np.asarray(x + height * tilt_y + 1j * (y + height * tilt_x))


def printed_run(
    p: RigidRotor, speed: float, starts: tuple[float, ...], times: np.ndarray
) -> PrintedRun:
    """The rotor from rest, the balls at rest on the race.

    Args:
        p: the rotor.
        speed: Omega [rad/s].
        starts: alpha of each ball at t = 0 [rad]; empty without balls.
        times: of the samples [s], rising.
    """
    n = len(starts)
    start = np.concatenate([np.zeros(8), starts, np.zeros(n)])
    found = solve_ivp(
        _rates(p, speed, n), (0.0, times[-1]), start, "DOP853", times,
        rtol=TOLERANCE, atol=TOLERANCE * p.radius * 1e-3,
    )  # fmt: skip
    return PrintedRun(found.t, found.y[:4].T, found.y[8 : 8 + n].T)


def _rates(p: RigidRotor, speed: float, n: int) -> Callable[[float, np.ndarray], np.ndarray]:
    """f of y' = f(t, y); y = (q, q', alpha, alpha')."""
    z = np.array(p.planes[:n])
    heavy = np.full(n, p.ball_mass)
    stiffness, damping = np.zeros((4, 4)), np.zeros((4, 4))
    for b in p.bearings:
        lever = np.outer((1.0, b.height), (1.0, b.height))
        for way in (0, 1):
            here = slice(2 * way, 2 * way + 2)
            stiffness[here, here] += b.stiffness[way] * lever
            damping[here, here] += b.damping[way] * lever
    damping[1, 3], damping[3, 1] = speed * p.polar, -speed * p.polar
    own = np.array([[p.mass, 0.0], [0.0, p.transverse]])
    own += np.array([[heavy.sum(), heavy @ z], [heavy @ z, heavy @ z**2]])
    mass = np.zeros((4 + n, 4 + n))
    mass[:2, :2] = mass[2:4, 2:4] = own
    mass[4:, 4:] = np.diag(heavy * p.radius**2)
    b_k = p.ball_mass * p.radius * np.array([np.ones(n), z])
    rotor = np.array([p.mass * p.eccentricity * np.exp(1j * p.phase), p.couple])

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        q, moving, alpha, rate = np.split(y, [4, 8, 8 + n])
        turned = b_k * np.exp(1j * (speed * t + alpha))
        push = speed**2 * rotor * np.exp(1j * speed * t) + turned @ (speed + rate) ** 2
        mass[:4, 4:] = np.concatenate([-turned.imag, turned.real])
        mass[4:, :4] = mass[:4, 4:].T
        force = np.concatenate([push.real, push.imag]) - damping @ moving - stiffness @ q
        changes = np.linalg.solve(mass, np.concatenate([force, -p.drag * rate]))
        return np.concatenate([moving, changes[:4], rate, changes[4:]])

    return rates

"""The papers' own equations, which are linear in the deck, integrated by SciPy: ours are checked.

(1) and (2) of the paper on the rig: q = (X, phi_Y, Y, -phi_X), f = (M eps exp(i beta),
chi (J_t - J_p)), b_k = m R (1, z_k), A_k = Omega + alpha_k',

    (M + m) q'' + C q' + Omega G q' + K q = Omega^2 (Re, Im)[f exp(i Omega t)]
        + sum of A_k^2 (Re, Im)[b_k exp(i phi_k)] + alpha_k'' (Im, -Re)[b_k exp(i phi_k)]
    m R^2 alpha_k'' + c_b alpha_k'
        = m R ((X'' + z phi_Y'') sin phi_k - (Y'' - z phi_X'') cos phi_k)

with phi_k = Omega t + alpha_k.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from gallery.two_plane.rotor import RigidRotor

TOLERANCE = 1e-11
TURN = 361
"""Samples in a turn, both ends."""


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

    Parameters
    ----------
    p
        The rotor.
    speed
        Omega [rad/s].
    starts
        Alpha of each ball at t = 0 [rad]; empty without balls.
    times
        Of the samples [s], rising.
    """
    n = len(starts)
    start = np.concatenate([np.zeros(8), starts, np.zeros(n)])
    rates = _rates(p if starts else p._replace(planes=()), speed)
    found = solve_ivp(
        rates, (0.0, times[-1]), start, "DOP853", times,
        rtol=TOLERANCE, atol=TOLERANCE * p.radius * 1e-3,
    )  # fmt: skip
    return PrintedRun(found.t, found.y[:4].T, found.y[8 : 8 + n].T)


def printed_turn(p: RigidRotor, speed: float, height: float) -> np.ndarray:
    """X + i Y of the shaft over a turn of the rotor without balls, after all has died away [m].

    Parameters
    ----------
    p
        The rotor.
    speed
        Omega [rad/s].
    height
        Of the place on the shaft, from C [m].
    """
    bare = p._replace(planes=())
    stiffness, damping, mass = _matrices(bare, speed)
    rotor = speed**2 * _unbalance(p)
    q = np.linalg.solve(
        stiffness - speed**2 * mass + 1j * speed * damping, np.concatenate([rotor, -1j * rotor])
    )
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, TURN))
    x, y = (((q[k] + height * q[k + 1]) * turn).real for k in (0, 2))
    return np.asarray(x + 1j * y)


def growth(p: RigidRotor, speed: float, alphas: np.ndarray) -> float:
    """Largest real part of an eigenvalue about balance, between isotropic bearings [1/s].

    Seen from the rotor, r = (X + i Y, phi_Y - i phi_X) exp(-i Omega t), the equations do not
    depend on time; r = 0 there. Here with x = (Re r, Im r, alpha - alphas).

    Parameters
    ----------
    p
        The rotor.
    speed
        Omega [rad/s].
    alphas
        Where its balls balance it [rad].
    """
    stiffness, damping, mass = (each[:2, :2] for each in _matrices(p, speed))
    spin = np.diag([0.0, p.polar])
    balls = (
        p.ball_mass * p.radius * np.array([np.ones(len(alphas)), p.planes]) * np.exp(1j * alphas)
    )
    felt, n, w = balls.conj(), len(alphas), speed
    rest = stiffness - w**2 * (mass - spin) + 1j * w * damping
    moving = damping + 1j * w * (2.0 * mass - spin)
    inertia = _real(mass, 1j * balls, felt)
    resistance = _real(moving, -2.0 * w * balls, 2j * w * felt)
    spring = _real(rest, -1j * w**2 * balls, -(w**2) * felt)
    inertia[4:, 4:] = p.ball_mass * p.radius**2 * np.eye(n)
    resistance[4:, 4:] = p.drag * np.eye(n)
    flow = np.block([[np.zeros((4 + n, 4 + n)), np.eye(4 + n)], [-spring, -resistance]])
    flow[4 + n :] = np.linalg.solve(inertia, flow[4 + n :])
    return float(np.linalg.eigvals(flow).real.max())


def _real(own: np.ndarray, balls: np.ndarray, felt: np.ndarray) -> np.ndarray:
    """Complex coefficients as real ones.

    Parameters
    ----------
    own
        Of r in its equations.
    balls
        Of alpha in them.
    felt
        Of r in the balls' equations, which have the imaginary part.
    """
    n = balls.shape[1]
    found = np.zeros((4 + n, 4 + n))
    found[:4, :4] = np.block([[own.real, -own.imag], [own.imag, own.real]])
    found[:4, 4:] = np.concatenate([balls.real, balls.imag])
    found[4:, :4] = np.concatenate([felt.imag, felt.real]).T
    return found


def _unbalance(p: RigidRotor) -> np.ndarray:
    return np.array([p.mass * p.eccentricity * np.exp(1j * p.phase), p.couple])


def _matrices(p: RigidRotor, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """K, C + Omega G and M of (1), with all balls, of q; each shape (4, 4)."""
    z, stiffness, damping = np.array(p.planes), np.zeros((4, 4)), np.zeros((4, 4))
    for b in p.bearings:
        lever = np.outer((1.0, b.height), (1.0, b.height))
        for way in (0, 1):
            here = slice(2 * way, 2 * way + 2)
            stiffness[here, here] += b.stiffness[way] * lever
            damping[here, here] += b.damping[way] * lever
    damping[1, 3], damping[3, 1] = speed * p.polar, -speed * p.polar
    own = p.ball_mass * np.array([[len(z), z.sum()], [z.sum(), z @ z]])
    own += np.diag([p.mass, p.transverse])
    return stiffness, damping, np.kron(np.eye(2), own)


def _rates(p: RigidRotor, speed: float) -> Callable[[float, np.ndarray], np.ndarray]:
    """f of y' = f(t, y); y = (q, q', alpha, alpha')."""
    n = len(p.planes)
    stiffness, damping, own = _matrices(p, speed)
    mass = np.zeros((4 + n, 4 + n))
    mass[:4, :4] = own
    mass[4:, 4:] = p.ball_mass * p.radius**2 * np.eye(n)
    b_k = p.ball_mass * p.radius * np.array([np.ones(n), p.planes])
    rotor = _unbalance(p)

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

"""Small-angle equations of Kim and Chung (2002), (13)-(19), with corrections of their errors.

Source: deck-3d (``seeds/004_c69cf52d9092f4e1.txt``); the corrections are from section 4 of
EQUATIONS.md. A plate on four equal mounts at its corners, with its centre P at (0, -d) from the
spindle; a disc of eccentricity eps at constant speed; n equal balls on a race in its plane;
everything at z = 0. Products of X, Y, Z, alpha, beta, gamma and their derivatives are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from .deck_params import Ball, Body, DeckParams, Disc, Mount, Race
from .params import Spindle
from .plant import Array


@dataclass(frozen=True)
class Plate:
    """Parameters of the paper, with its symbols."""

    M_P: float = 0.1
    M: float = 0.03
    m: float = 2e-4
    n: int = 2
    a: float = 0.12
    b: float = 0.12
    d: float = 0.03
    R: float = 0.03
    k: float = 1063.1
    c: float = 0.6
    D: float = 1e-5
    eps: float = -2.0 * 2e-4 * 0.03 * np.cos(np.deg2rad(142.3)) / 0.03
    """Eccentricity -2 m R cos(142.3 deg) / M, which the paper's balls balance at +-142.3 deg."""
    omega: float = 335.0

    def but(self, **changes: float) -> "Plate":
        """Return the parameters with some of them replaced."""
        return replace(self, **changes)  # type: ignore[arg-type]

    @property
    def inertias(self) -> tuple[float, float, float, float, float]:
        """Return J_Px, J_Py, J_Pz, J and J_z of (9)."""
        x, y = self.M_P * self.b**2 / 12.0, self.M_P * self.a**2 / 12.0
        return x, y, x + y, 0.25 * self.M * self.R**2, 0.5 * self.M * self.R**2

    def exact(self) -> DeckParams:
        """Return the same deck for the exact equations."""
        x, y, z, across, along = self.inertias
        corners = [(i * self.a / 2, j * self.b / 2 - self.d) for i in (-1, 1) for j in (-1, 1)]
        return DeckParams(
            Body(self.M_P, (0.0, -self.d, 0.0), np.diag([x, y, z])),
            Disc(self.M, 0.0, self.eps, 0.0, np.diag([across, across, along])),
            (Race(self.R, (Ball(self.m),) * self.n, 0.0, self.D),),
            tuple(Mount((*corner, 0.0), (self.k,) * 3, (self.c,) * 3) for corner in corners),
            spindle=Spindle(self.omega),
        )

    def accelerations(self, t: float, q: Array, rates: Array) -> Array:
        """Return q'' of q = X, Y, Z, alpha, beta, gamma, phi_i."""
        M_P, M, m, n, a, b, d, R = (self.M_P, self.M, self.m, self.n, self.a, self.b, self.d,
                                    self.R)  # fmt: skip
        k, c, D, eps, w = self.k, self.c, self.D, self.eps, self.omega
        J_Px, J_Py, J_Pz, J, J_z = self.inertias
        X, Y, Z, alpha, beta, gamma = q[:6]
        vX, vY, vZ, valpha, vbeta, vgamma = rates[:6]
        s, co = np.sin(w * t), np.cos(w * t)
        S, C, p = np.sin(q[6:] + w * t), np.cos(q[6:] + w * t), rates[6:] + w
        sum_S, sum_C = m * R * S.sum(), m * R * C.sum()
        sum_SS, sum_CC, sum_CS = (m * R**2 * (u @ v) for u, v in ((S, S), (C, C), (C, S)))
        turn_SS, turn_CC, turn_CS = (m * R**2 * (p * u) @ v for u, v in ((S, S), (C, C), (C, S)))
        total, whirl = M + M_P + n * m, 2.0 * vgamma + p
        left, right = np.zeros((6 + n, 6 + n)), np.zeros(6 + n)

        # (13)
        left[0, 0], left[0, 5] = total, M_P * d - M * eps * s - sum_S
        left[0, 6:] = -m * R * (S + gamma * C)
        right[0] = M * eps * w**2 * co - 4 * c * vX - 4 * k * X
        right[0] -= (4 * c * d - 2 * M * eps * w * co) * vgamma
        right[0] -= (4 * d * k + M * eps * w**2 * s) * gamma
        right[0] += m * R * np.sum(p * whirl * C - p**2 * gamma * S)

        # (14)
        left[1, 1], left[1, 5] = total, M * eps * co + sum_C
        left[1, 6:] = m * R * (C - gamma * S)
        right[1] = M * eps * w**2 * s - 4 * c * vY - 4 * k * Y
        right[1] += 2 * M * eps * w * s * vgamma + M * eps * w**2 * co * gamma
        right[1] += m * R * np.sum(p * whirl * S + p**2 * gamma * C)

        # (15)
        left[2, 2], left[2, 3] = total, M * eps * s - M_P * d + sum_S
        left[2, 4] = -M * eps * co - sum_C
        left[2, 6:] = m * R * (alpha * C + beta * S)
        right[2] = -4 * c * vZ - 4 * k * Z + (4 * c * d - 2 * M * eps * w * co) * valpha
        right[2] += (4 * d * k + M * eps * w**2 * s) * alpha
        right[2] -= 2 * M * eps * w * s * vbeta + M * eps * w**2 * co * beta
        right[2] -= m * R * np.sum((2 * p * valpha + p**2 * beta) * C)
        right[2] -= m * R * np.sum((2 * p * vbeta - p**2 * alpha) * S)

        # (16)
        left[3, 2] = left[2, 3]
        left[3, 3] = J + J_Px + M_P * d**2 + M * eps**2 * s**2 + sum_SS
        left[3, 4] = -M * eps**2 * co * s - sum_CS
        left[3, 6:] = m * R**2 * beta
        right[3] = 4 * c * d * vZ + 4 * d * k * Z - (b**2 + 4 * d**2) * (c * valpha + k * alpha)
        right[3] -= 2 * (M * eps**2 * w * co * s + turn_CS) * valpha
        right[3] -= (J_z * w + 2 * M * eps**2 * w * s**2 + 2 * turn_SS) * vbeta

        # (17)
        left[4, 2], left[4, 3] = left[2, 4], left[3, 4]
        left[4, 4] = J + J_Py + M * eps**2 * co**2 + sum_CC
        right[4] = -(a**2) * (c * vbeta + k * beta)
        right[4] += (J_z * w + 2 * M * eps**2 * w * co**2 + 2 * turn_CC) * valpha
        right[4] += 2 * (M * eps**2 * w * co * s + turn_CS) * vbeta

        # (18)
        left[5, 0], left[5, 1] = left[0, 5], left[1, 5]
        left[5, 5] = J_z + J_Pz + M_P * d**2 + n * m * R**2 + M * eps**2
        left[5, 6:] = m * R**2
        right[5] = -4 * d * (c * vX + k * X)
        right[5] -= (a**2 + b**2 + 4 * d**2) * (c * vgamma + k * gamma)

        # (19)
        left[6:, 0], left[6:, 1] = -m * R * S, m * R * C
        left[6:, 5], left[6:, 6:] = m * R**2, m * R**2 * np.eye(n)
        right[6:] = -D * rates[6:]
        return np.linalg.solve(left, right)


def simulate_small_angle(
    p: Plate,
    q0: Sequence[float] | Array,
    rates0: Sequence[float] | Array,
    times: Sequence[float] | Array,
    rtol: float = 1e-11,
) -> tuple[Array, Array]:
    """Return q and q' at increasing times, a row each."""
    size = 6 + p.n

    def slope(t: float, y: Array) -> Array:
        return np.concatenate([y[size:], p.accelerations(t, y[:size], y[size:])])

    scales = np.concatenate(
        [[1e-5] * 3, [1e-4] * 3, [1.0] * p.n, [1e-3] * 3, [1e-2] * 3, [10.0] * p.n]
    )
    start = np.concatenate([q0, rates0])
    solution = solve_ivp(
        slope, (0.0, times[-1]), start, method="DOP853", t_eval=times, rtol=rtol,
        atol=rtol * scales,
    )  # fmt: skip
    return solution.y[:size].T, solution.y[size:].T

"""Lagrangian of the planar rotor in the inertial frame, written as a sum of squares.

Coordinates q = (x, y, psi, psi_1 .. psi_n): deck centre from its static equilibrium, spindle
angle, and *absolute* angles of the balls about the race centre's direction. Every velocity that
carries kinetic energy is a row of V(q) q', so that

    T = 1/2 sum_r W_r (V q')_r^2,    d/dt(V q') = V q'' + b
    =>  (V^T W V) q'' + V^T W b = Q    (Lagrange's equations, dense mass matrix)

The rows are: deck without unbalance mass (2), unbalance mass M0 at distance e (2), rotor (1),
x of every ball (n), y of every ball (n), spin w - s'/a of every ball (n), where s' is the path
speed of the ball along the race.
"""

from math import cos, sin
from typing import NamedTuple

import numpy as np

from .params import Params
from .plant import Array, Curve, Plant, System


class Kinematics(NamedTuple):
    """Matrices V, b and V^T W V as above, and geometry on which forces act."""

    rows: Array
    """V, shape (5 + 3 n, 3 + n)."""
    bias: Array
    """b = (V)' q'."""
    mass: Array
    """Mass matrix V^T W V."""
    cosines: Array
    """cos psi_i, the x components of the race's outward unit normals at the balls."""
    sines: Array
    """sin psi_i, the y components of the race's outward unit normals at the balls."""
    path: Array
    """ds/dtheta of each ball; R on a circle."""
    arms: Array
    """Positions of the balls from the deck centre, shape (2, n), on inertial axes."""


class Model(Plant):
    """Params with derived constants: W, K, C, sag."""

    def __init__(self, p: Params) -> None:
        n = p.count
        self.p, self.psi, self.count, self.races = p, 2, n, (np.arange(n),)
        self.masses, self.radii = np.array(p.ball_masses), np.array(p.ball_radii)
        self.coefficients = np.array(p.friction_coefficients())
        shape = (p.race_radius, p.runout.oval, p.runout.oval_angle)
        self.curve, self.drag = Curve(*(np.full(n, s) for s in shape)), np.full(n, p.drag)
        self.scales = (1e-5, 1e-5), (1e-3, 1e-3)
        rest = p.mass - self.masses.sum() - p.carrier_mass
        inertia = 0.0 if p.motor is None else p.motor.inertia
        deck = [rest, rest, p.carrier_mass, p.carrier_mass, inertia]
        spin = 0.4 * p.spin * self.masses * self.radii**2
        self.weights = np.concatenate([deck, self.masses, self.masses, spin])
        self.gravity = np.array(p.gravity)
        gx, gy = p.gravity
        pull = np.concatenate([[gx, gy, gx, gy, 0.0], np.full(n, gx), np.full(n, gy), np.zeros(n)])
        self.weight_force = self.weights * pull
        c, s = cos(p.suspension.axis_angle), sin(p.suspension.axis_angle)
        turn = np.array([[c, -s], [s, c]])
        self.stiffness = turn @ np.diag([p.suspension.k1, p.suspension.k2]) @ turn.T
        self.damping = turn @ np.diag([p.suspension.c1, p.suspension.c2]) @ turn.T
        self.sag = self._sag()
        self._template = np.zeros((5 + 3 * n, self.size))
        for row, column in ((0, 0), (1, 1), (2, 0), (3, 1), (4, 2)):
            self._template[row, column] = 1.0
        self._template[5 : 5 + n, 0] = self._template[5 + n : 5 + 2 * n, 1] = 1.0
        each = np.arange(n)
        self._own, self._in_x, self._in_y, self._spins = (
            at + each for at in (3, 5, 5 + n, 5 + 2 * n)
        )

    def kinematics(self, q: Array, rates: Array) -> Kinematics:
        """Return V, b and geometry at coordinates ``q`` and ``rates`` q'.

        A ball is at P = r + Q(psi) X(theta), theta = psi_i - psi. With X' = g t, g = h + h'':

            dP/dpsi_i = g t,   dP/dpsi = J X - g t
            P'' bias  = 2 w theta' J X' + theta'^2 X'' - w^2 X,   X'' = g' t - g n
        """
        p, n, psi, w = self.p, self.count, float(q[2]), float(rates[2])
        slide = rates[3:] - w
        co, si = np.cos(q[3:]), np.sin(q[3:])
        h, dh, path, dpath = self.curve.at(q[3:] - psi)
        ax, ay = cos(psi), sin(psi)
        d1, d2 = p.runout.offset
        arm_x = d1 * ax - d2 * ay + h * co - dh * si
        arm_y = d1 * ay + d2 * ax + h * si + dh * co
        along_x, along_y = -path * si, path * co

        rows = self._template.copy()
        bias = np.zeros(5 + 3 * n)
        e = p.eccentricity
        rows[2, 2], rows[3, 2] = -e * ay, e * ax
        bias[2], bias[3] = -e * w * w * ax, -e * w * w * ay
        own, in_x, in_y, spins = self._own, self._in_x, self._in_y, self._spins
        rows[in_x, 2], rows[in_y, 2] = -arm_y - along_x, arm_x - along_y
        rows[in_x, own], rows[in_y, own] = along_x, along_y
        cross, square = 2.0 * w * slide, slide * slide
        bias[in_x] = -cross * along_y + square * (-dpath * si - path * co) - w * w * arm_x
        bias[in_y] = cross * along_x + square * (dpath * co - path * si) - w * w * arm_y
        roll = path / self.radii
        rows[spins, 2], rows[spins, own] = 1.0 + roll, -roll
        bias[spins] = -dpath * square / self.radii
        mass = rows.T @ (self.weights[:, None] * rows)
        return Kinematics(rows, bias, mass, co, si, path, np.array([arm_x, arm_y]))

    def system(self, q: Array, rates: Array) -> System:
        """Return the equations of motion; N = -m (P'' - g) . n."""
        n, k = self.count, self.kinematics(q, rates)
        gx, gy = self.gravity
        in_x, in_y = slice(5, 5 + n), slice(5 + n, 5 + 2 * n)
        pull_x, pull_y = -self.masses * k.cosines, -self.masses * k.sines
        rows = pull_x[:, None] * k.rows[in_x] + pull_y[:, None] * k.rows[in_y]
        known = pull_x * (k.bias[in_x] - gx) + pull_y * (k.bias[in_y] - gy)
        damping = float(rates[:2] @ self.damping @ rates[:2])
        return System(k.mass, self.known_forces(k, q, rates), rows, known, k.path, damping)

    def known_forces(self, k: Kinematics, q: Array, rates: Array) -> Array:
        """Return Q - V^T W b, with Q of suspension, gravity (V^T W g) and race drag.

        The drag -c_b s' does work on the path of each ball, s' = g (psi_i' - psi').
        """
        force = k.rows.T @ (self.weight_force - self.weights * k.bias)
        force[:2] += self.spring_force(self.sag + q[:2]) - self.damping @ rates[:2]
        drag = -self.p.drag * k.path**2 * (rates[3:] - rates[2])
        force[3:] += drag
        force[2] -= drag.sum()
        return force

    def spring_force(self, u: Array) -> Array:
        """Return -K u - cubic |u|^2 u at a displacement u from the unloaded suspension [N]."""
        return -(self.stiffness @ u) - self.p.suspension.cubic * (u @ u) * u

    def _sag(self) -> Array:
        """Return the displacement under gravity by Newton's method: spring_force(sag) = -M g."""
        load = self.p.mass * self.gravity
        u = np.zeros(2)
        if not load.any():
            return u
        for _ in range(200):
            bend = (u @ u) * np.eye(2) + 2.0 * np.outer(u, u)
            tangent = self.stiffness + self.p.suspension.cubic * bend
            step = np.linalg.solve(tangent, load + self.spring_force(u))
            u = u + step
            if np.abs(step).max() <= 1e-15 * np.abs(u).max():
                break
        return u

    def energy(self, q: Array, rates: Array) -> float:
        """Return the energy of motion, springs and gravity [J], I_r w^2/2 with a motor."""
        k = self.kinematics(q, rates)
        u = self.sag + q[:2]
        kinetic = 0.5 * self.weights @ (k.rows @ rates) ** 2
        springs = 0.5 * u @ self.stiffness @ u + 0.25 * self.p.suspension.cubic * (u @ u) ** 2
        axis = np.array([cos(q[2]), sin(q[2])])
        moment = self.p.mass * q[:2] + self.p.carrier_mass * self.p.eccentricity * axis
        moment += k.arms @ self.masses
        return float(kinetic + springs - moment @ self.gravity)

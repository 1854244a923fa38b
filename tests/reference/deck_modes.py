"""Vibration of the deck about its rest position, with disc and balls averaged over a turn.

The system matrices are derivatives of the equations of ``deck_model`` by complex steps, so they are
exact to rounding.
"""

from typing import NamedTuple

import numpy as np

from .deck_model import DeckModel, disc_inertia
from .deck_params import DeckParams, Disc
from .params import Spindle
from .plant import Array
from .pose import pseudo_inertia

STEP = 1e-30


class Vibration(NamedTuple):
    """Equations M u'' + C u' + K u = 0 about ``rest``, u of X, Y, Z, alpha, beta, gamma."""

    rest: Array
    mass: Array
    damping: Array
    """Damping matrix with the gyroscopic terms."""
    stiffness: Array


class ModeShape(NamedTuple):
    """Mode u = shape exp(eigenvalue t), with its conjugate."""

    eigenvalue: complex
    shape: Array
    """Shape, whose largest entry, in m or rad, is 1."""

    @property
    def natural(self) -> float:
        """Return the natural frequency [rad/s]."""
        return abs(self.eigenvalue)

    @property
    def damping_ratio(self) -> float:
        """Return the damping relative to critical damping."""
        return -self.eigenvalue.real / abs(self.eigenvalue)


def averaged(p: DeckParams) -> DeckParams:
    """Return the deck with a symmetric disc instead of disc and balls.

    Disc and balls turn together, the balls spread evenly along round races, and their
    pseudo-inertia is averaged over a turn. The unbalance M eps^2 and the balls' m R^2 are included.
    """
    whole = disc_inertia(p)
    for race in p.races:
        for ball in race.balls:
            for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                place = np.array([x * race.radius, y * race.radius, race.height])
                whole += 0.25 * pseudo_inertia(ball.mass, place, ball.inertia * np.eye(3))
    mass, height = whole[3, 3], whole[2, 3] / whole[3, 3]
    across, along = 0.5 * (whole[0, 0] + whole[1, 1]), whole[2, 2] - mass * height**2
    inertia = np.diag([across + along, across + along, 2.0 * across])
    return p.but(disc=Disc(mass, height, inertia=inertia), races=(), motor=None)


def linearise(p: DeckParams, speed: float = 0.0) -> Vibration:
    """Linearise about the rest of the averaged deck, with its disc turning at ``speed`` [rad/s].

    Raises
    ------
    numpy.linalg.LinAlgError
        Nothing holds the deck.
    """
    model = DeckModel(averaged(p).but(spindle=Spindle(speed)))

    def force(place: Array, rates: Array) -> Array:
        return model.system(np.append(place, 0.0), np.append(rates, speed)).known[:6]

    def slope(place: Array, by_rates: bool) -> Array:
        steps, still = 1j * STEP * np.eye(6), np.zeros(6)
        columns = [force(place, step) if by_rates else force(place + step, still) for step in steps]
        return np.imag(columns).T / STEP

    rest = np.zeros(6)
    for _ in range(50):
        change = np.linalg.solve(slope(rest, False), force(rest, np.zeros(6)))
        rest = rest - change
        if np.abs(change).max() <= 1e-15:
            mass = model.system(np.append(rest, 0.0), np.append(np.zeros(6), speed)).mass
            return Vibration(rest, mass[:6, :6], -slope(rest, True), -slope(rest, False))
    raise RuntimeError("the deck finds no rest")


def modes(p: DeckParams, speed: float = 0.0) -> list[ModeShape]:
    """Return the modes by natural frequency, with positive imaginary parts of conjugate pairs."""
    found = linearise(p, speed)
    zero, one = np.zeros((6, 6)), np.eye(6)
    inverse = np.linalg.inv(found.mass)
    matrix = np.block([[zero, one], [-inverse @ found.stiffness, -inverse @ found.damping]])
    values, vectors = np.linalg.eig(matrix)
    made = []
    for value, vector in zip(values, vectors[:6].T, strict=True):
        if value.imag >= 0.0:
            made.append(ModeShape(complex(value), vector / vector[np.abs(vector).argmax()]))
    return sorted(made, key=lambda mode: mode.natural)

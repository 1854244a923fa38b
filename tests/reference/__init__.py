"""Independent references: Lagrange's equations on inertial axes, dense mass matrix, scipy.

Slow, small, and sharing no line with ab_sim. In the plane, for the corotating O(n) kernel:

    result = simulate(Params(...), theta0, times)
    result.x, result.vx, result.theta, result.theta_rate, result.w, result.events, result.energy()

In space, for the deck with six degrees of freedom; q = (X, Y, Z, alpha, beta, gamma, phi_1 ..):

    now = instant(DeckParams(...), q, rates, psi=..., speed=..., acceleration=...)
    now.accelerations, now.torque, now.losses, now.kinetic, now.potential, now.specific_force
    result = simulate_deck(DeckParams(...), q0, rates0, times)
    result.deck, result.deck_rates, and as above
    modes(DeckParams(...), speed)

Both run through the same laws of friction, contact and motor, with located events.
"""

from .deck import Instant, instant, simulate_deck
from .deck_modes import averaged, linearise, modes
from .deck_params import Ball, Body, DeckParams, Disc, Mount, Race
from .params import Contact, Friction, Motor, Params, Runout, Spindle, Suspension
from .run import Event, Result, Start, simulate
from .small_angle import Plate, simulate_small_angle

__all__ = [
    "Ball", "Body", "Contact", "DeckParams", "Disc", "Event", "Friction", "Instant", "Motor",
    "Mount", "Params", "Plate", "Race", "Result", "Runout", "Spindle", "Start", "Suspension",
    "averaged", "instant", "linearise", "modes", "simulate", "simulate_deck",
    "simulate_small_angle",
]  # fmt: skip

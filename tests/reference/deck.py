"""Deck in space: forces and accelerations at an instant, and motion over time.

    p = DeckParams(...), or deck_params(case["params"]) of an oracle case
    now = instant(p, q, rates, psi=..., speed=..., acceleration=...)
    run = simulate_deck(p, q0, rates0, times)
    run.deck, run.theta, run.psi, run.w, run.losses, run.work, run.energy(), run.events
    (and deck_rates, theta_rate)

States are q = (X, Y, Z, alpha, beta, gamma, phi_1 ..) and its time derivative.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .contact import chain_of
from .deck_model import DeckModel
from .deck_params import DeckParams
from .dynamics import Mode, solve
from .friction import choose_mode
from .motor import Command
from .plant import Array
from .run import Result, follow


class Instant(NamedTuple):
    """Accelerations, forces and energies at one instant."""

    accelerations: Array
    """Accelerations q''."""
    spindle: float
    """Acceleration of the spindle psi'' [rad/s^2]."""
    torque: float
    """Torque of the motor between deck and rotor [N m]."""
    power: float
    """Power of the motor [W]."""
    losses: Array
    """Losses in mounts, drag and friction [W]."""
    kinetic: float
    potential: float
    """Potential energy [J]; that of gravity counts from the ground's origin."""
    friction: Array
    """Friction along the race on each ball [N]."""
    normal: Array
    """Normal force of the race on each ball, inwards, in the disc's plane [N]."""
    mode: Mode
    specific_force: Array
    """P'' - g of ``sensor`` along ``sensor_axes`` [m/s^2]."""


def instant(
    p: DeckParams,
    q: Sequence[float] | Array,
    rates: Sequence[float] | Array,
    *,
    psi: float = 0.0,
    speed: float = 0.0,
    acceleration: float = 0.0,
    command: float | None = None,
    z: float = 0.0,
    sensor: Sequence[float] | Array = (0.0, 0.0, 0.0),
    sensor_axes: Sequence[Sequence[float]] | Array = np.eye(3),  # noqa: B008
) -> Instant:
    """Return accelerations, forces and energies in a state.

    Parameters
    ----------
    p
        Parameters of the deck.
    q
        X, Y, Z [m], alpha, beta, gamma, phi_i [rad].
    rates
        Time derivatives q'.
    psi
        Spindle angle [rad].
    speed
        Spindle speed psi' [rad/s].
    acceleration
        Psi'' [rad/s^2]; with a motor, that of the command.
    command
        Commanded speed of a motor [rad/s]; default: ``speed``.
    z
        Integral of the motor's controller.
    sensor
        Point of the deck on deck axes [m].
    sensor_axes
        Unit vectors on deck axes, one per row.
    """
    model = DeckModel(p)
    full, full_rates = _with_spindle(q, psi), _with_spindle(rates, speed)
    asked = Command(psi, speed if command is None else command, acceleration)
    chain = chain_of(model, model.theta(full))
    mode = choose_mode(model, chain, asked, full, full_rates, z)
    found = solve(model, chain, mode, asked, full, full_rates, z)
    gain = found.accelerations
    return Instant(
        np.append(gain[:6], model.theta(gain)),
        float(gain[6]),
        found.torque,
        found.torque * speed,
        found.losses,
        float(model.kinetic_energy(full, full_rates)),
        float(model.potential_energy(full)),
        found.friction,
        found.normal,
        mode,
        model.specific_force(full, full_rates, gain, np.array(sensor), np.array(sensor_axes)),
    )


def _with_spindle(q: Sequence[float] | Array, psi: float) -> Array:
    """Return (X, .., gamma, psi, psi_i) from (X, .., gamma, phi_i); also for rates."""
    q = np.array(q, float)
    return np.concatenate([q[:6], [psi], psi + q[6:]])


def simulate_deck(
    p: DeckParams,
    q0: Sequence[float] | Array,
    rates0: Sequence[float] | Array,
    times: Sequence[float] | Array,
    *,
    speed: float | None = None,
    z: float = 0.0,
    method: str = "DOP853",
    rtol: float = 1e-12,
    max_step: float = np.inf,
) -> Result:
    """Return the motion from q0 and q0' at t = 0, with the spindle as in ``p.spindle``.

    Parameters
    ----------
    p
        Parameters of the deck.
    q0
        X, Y, Z [m], alpha, beta, gamma, phi_i [rad].
    rates0
        Time derivatives q'.
    times
        Increasing times from 0 or later [s].
    speed
        Psi' with a motor [rad/s]; default: that of the command.
    z
        Integral of the motor's controller.
    method
        Method of solve_ivp; "Radau" for a stiff race or stiff mounts.
    rtol
        Relative tolerance; the absolute ones follow from it.
    max_step
        Longest step [s], if an event could hide within a step.
    """
    q, rates = np.array(q0, float), np.array(rates0, float)
    return follow(
        DeckModel(p), q[:6], q[6:], rates[:6], rates[6:], times, speed=speed, z=z,
        method=method, rtol=rtol, max_step=max_step,
    )  # fmt: skip

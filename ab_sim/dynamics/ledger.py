"""The energy ledger: motor work and losses, integrated along with the motion if asked for.

Two extra states after the balls': the work that the motor has done and the energy dissipated,
both [J]. A system with an empty ledger has neither the states nor this code.
"""

from math import cos, sin
from typing import Any, NamedTuple

from numba.extending import overload

from ab_sim.dynamics.dispatch import COMPILED, any_effect_has, sum_over_effects
from ab_sim.dynamics.motion import Ball, BallMotion, Body, Deck, Reaction
from ab_sim.dynamics.scratch import ACCELERATION, COS, FRICTION, LOAD, SIN

motor_torque = sum_over_effects("motor_torque", 0.0)
deck_loss = sum_over_effects("deck_loss", 0.0)
ball_loss = sum_over_effects("ball_loss", 0.0)
deck_energy = sum_over_effects("deck_energy", 0.0)
has_friction = any_effect_has("friction_coefficient")
ball_energy = sum_over_effects("ball_energy", 0.0)


class Ledger(NamedTuple):
    """Asks the kernel to keep the ledger."""


def ledger_states(ledger: tuple[Any, ...]) -> int:
    """How many states a ledger adds."""
    return 2 * len(ledger)


def book(
    ledger: Any,
    system: Any,
    deck: Any,
    A1: float,
    A2: float,
    state: Any,
    slope: Any,
    scratch: Any,
) -> None:
    """Put motor power and dissipated power [W] behind the balls' derivatives, if asked for."""
    if not ledger:
        return
    body, effects = system.body, system.effects
    n = system.ball_masses.size
    # Unbalance: the motor turns M0 e against the deck's acceleration across it.
    torque = body.unbalance * (A2 + body.eccentricity * deck.acceleration)
    loss = deck_loss(effects, deck)
    for i in range(n):
        ball = Ball(system.ball_masses[i], system.ball_radii[i])
        c, s = scratch[i, COS], scratch[i, SIN]
        rate = state[4 + n + i]
        motion = BallMotion(c, s, rate, deck.speed + rate)
        normal = scratch[i, LOAD] - ball.mass * (A1 * c + A2 * s)
        if has_friction(effects) and scratch[i, FRICTION] == 0.0:
            # Unloaded, so that the motion has no friction either.
            normal = 0.0
        reaction = Reaction(scratch[i, ACCELERATION], normal)
        torque += motor_torque(effects, body, ball, motion, deck, reaction)
        loss += ball_loss(effects, body, ball, motion, reaction)
    slope[4 + 2 * n] = torque * deck.speed
    slope[5 + 2 * n] = loss


@overload(book, jit_options=COMPILED, strict=False)
def _book(ledger, system, deck, A1, A2, state, slope, scratch):  # type: ignore[no-untyped-def]
    if len(ledger):
        return book
    return lambda ledger, system, deck, A1, A2, state, slope, scratch: None


def mechanical_energy(system: Any, deck: Deck, angles: Any, rates: Any) -> float:
    """Kinetic and stored energy [J], without the rotor's constant-inertia term I_G w^2 / 2.

    Args:
        system: the System.
        deck: motion of the deck; only u, v and the speed matter.
        angles: theta_i [rad], shape (n,).
        rates: theta_i' [rad/s], shape (n,).
    """
    body: Body = system.body
    w, e = deck.speed, body.eccentricity
    rest = body.total_mass - float(system.ball_masses.sum())
    energy = 0.5 * rest * (deck.v1**2 + deck.v2**2)
    energy += body.unbalance * w * (deck.v2 + 0.5 * e * w)
    energy += deck_energy(system.effects, deck)
    for mass, radius, theta, rate in zip(
        system.ball_masses, system.ball_radii, angles, rates, strict=True
    ):
        motion = BallMotion(cos(theta), sin(theta), rate, w + rate)
        along = body.race_radius * motion.speed
        v1, v2 = deck.v1 - along * motion.sin, deck.v2 + along * motion.cos
        energy += 0.5 * mass * (v1 * v1 + v2 * v2)
        energy += ball_energy(system.effects, body, Ball(mass, radius), motion, deck)
    return float(energy)

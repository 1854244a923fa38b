"""The energy ledger: motor work and losses, integrated along with the motion if asked for.

Two extra states behind all others: the work that the motor has done and the energy dissipated,
both [J]. A system with an empty ledger has neither the states nor this code.
"""

from math import cos, sin
from typing import Any, NamedTuple

from numba.extending import overload

from ab_sim.dynamics.balls import place_from_shaft
from ab_sim.dynamics.dispatch import INLINED, sum_over_effects
from ab_sim.dynamics.motion import Ball, Body, Deck, Spindle
from ab_sim.dynamics.reactions import reactions
from ab_sim.dynamics.scratch import (
    COS,
    FORCE,
    FRICTION,
    LEVER,
    PATH,
    PATH_ACCELERATION,
    SIN,
)
from ab_sim.dynamics.system import (
    MASS,
    RADIUS,
    ball_count,
    ball_drag,
    ball_inertia,
    gravity,
    has_drag,
    has_friction,
    has_gravity,
    has_motor,
    has_spin,
    race_shape,
    rotor_moment,
)

deck_loss = sum_over_effects("deck_loss", 0.0)
deck_energy = sum_over_effects("deck_energy", 0.0)
space_loss = sum_over_effects("space_loss", 0.0)
space_energy = sum_over_effects("space_energy", 0.0)


class Ledger(NamedTuple):
    """Asks the kernel to keep the ledger."""


def ledger_states(ledger: tuple[Any, ...]) -> int:
    """How many states a ledger adds."""
    return 2 * len(ledger)


def book(
    ledger: Any,
    system: Any,
    spindle: Any,
    A1: float,
    A2: float,
    al: float,
    state: Any,
    modes: Any,
    slope: Any,
    scratch: Any,
) -> None:
    """Put motor power and dissipated power [W] behind the other derivatives, if asked for."""
    if not ledger:
        return
    body, effects = system.body, system.effects
    n = ball_count(system)
    c, s = spindle.cos, spindle.sin
    v1, v2 = state[2], state[3]
    if has_friction(effects):
        reactions(system, A1, A2, al, modes, scratch)
    torque = body.unbalance * (A2 + body.eccentricity * al)
    loss = deck_loss(effects, Deck(state[0], state[1], v1, v2))
    loss += space_loss(effects, Deck(0.0, 0.0, c * v1 - s * v2, s * v1 + c * v2))
    for i in range(n):
        ball = Ball(system.balls[i, MASS], system.balls[i, RADIUS])
        rate = state[4 + n + i]
        h, x = place_from_shaft(system, i, scratch)
        path = scratch[i, PATH]
        along = A2 * scratch[i, COS] - A1 * scratch[i, SIN]
        outwards = A1 * scratch[i, COS] + A2 * scratch[i, SIN]
        torque += ball.mass * (h * along - x * outwards + (h * h + x * x) * al)
        torque += ball.mass * x * (2.0 * spindle.speed + rate) * path
        torque += scratch[i, LEVER] * scratch[i, PATH_ACCELERATION]
        if has_spin(effects):
            torque += ball_inertia(effects, ball) * ball.radius * ball.radius * al
        if has_drag(effects):
            loss += ball_drag(effects, ball) * path * path
        if has_friction(effects):
            loss += scratch[i, FRICTION] * scratch[i, FORCE] * path
    if has_motor(effects):
        torque = spindle.torque
    slope[state.size - 2] = torque * spindle.speed
    slope[state.size - 1] = loss


@overload(book, jit_options=INLINED, strict=False)
def _book(ledger, system, spindle, A1, A2, al, state, modes, slope, scratch):  # type: ignore[no-untyped-def]
    if len(ledger):
        return book
    return lambda ledger, system, spindle, A1, A2, al, state, modes, slope, scratch: None


def mechanical_energy(system: Any, deck: Deck, spindle: Spindle, angles: Any, rates: Any) -> float:
    """Kinetic and stored energy [J]; of the rotor's inertia I_r only what a motor accelerates.

    Args:
        system: the System.
        deck: motion of the deck on the rotating axes, from where it hangs at rest.
        spindle: only speed and angle matter.
        angles: theta_i [rad], shape (n,).
        rates: theta_i' [rad/s], shape (n,).
    """
    body: Body = system.body
    effects = system.effects
    w, e, R = spindle.speed, body.eccentricity, body.race_radius
    c, s = spindle.cos, spindle.sin
    u1, u2 = deck.x + c * body.sag_x + s * body.sag_y, deck.y + c * body.sag_y - s * body.sag_x
    g1, g2 = 0.0, 0.0
    if has_gravity(effects):
        gx, gy = gravity(effects)
        g1, g2 = c * gx + s * gy, c * gy - s * gx
    rest = body.total_mass - float(system.balls[:, MASS].sum())
    energy = 0.5 * rest * (deck.vx**2 + deck.vy**2) + 0.5 * rotor_moment(effects) * w * w
    energy += body.unbalance * w * (deck.vy + 0.5 * e * w)
    energy -= body.total_mass * (g1 * u1 + g2 * u2) + body.unbalance * g1
    energy += deck_energy(effects, deck._replace(x=u1, y=u2))
    energy += space_energy(effects, Deck(c * u1 - s * u2, s * u1 + c * u2, 0.0, 0.0))
    for (mass, radius), theta, rate in zip(
        system.balls[:, [MASS, RADIUS]], angles, rates, strict=True
    ):
        nc, ns = cos(theta), sin(theta)
        beyond, x, curve, _ = race_shape(effects, nc, ns)
        h, path = R + beyond, (R + curve) * rate
        along, outwards = h * w + path, -x * w
        v1, v2 = deck.vx - along * ns + outwards * nc, deck.vy + along * nc + outwards * ns
        energy += 0.5 * mass * (v1 * v1 + v2 * v2)
        energy -= mass * (g1 * (h * nc - x * ns) + g2 * (h * ns + x * nc))
        if has_spin(effects):
            spin = radius * w - path
            energy += 0.5 * ball_inertia(effects, Ball(mass, radius)) * spin * spin
    return float(energy)

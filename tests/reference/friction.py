"""Set-valued laws: modes that are consistent with a state, and the ends of modes.

Coulomb's law, contacts and the motor's limits are each a choice of mode with conditions. A mode
that meets all conditions at an instant is the motion just after it. Guards stay positive while the
mode lasts. They change sign slightly beyond the condition, so that a mode that has ended cannot be
chosen again at the same instant.
"""

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from . import motor as motors
from .contact import Chain, touching
from .dynamics import BACKWARD, FORWARD, FREE, STUCK, Forces, Mode, solve
from .plant import Array, Plant

FORCE_SLACK = 1e-13
"""Slack of forces [N]."""
RATE_SLACK = 1e-11
"""Slack of rates [rad/s]."""
GAP_SLACK = 1e-12
"""Slack of gaps [rad]."""
ACCELERATION_SLACK = 1e-9
"""Slack of the acceleration of a gap that opens [rad/s^2]."""


class Guard(NamedTuple):
    """Number that is positive as long as the mode lasts, and name of the event at its end."""

    kind: str
    which: int
    value: float


def pinned(mode: Mode, chain: Chain) -> set[int]:
    """Return the balls that cannot move: stuck ones, and those tied to them by closed contacts."""
    held = {i for i, state in enumerate(mode.balls) if state == STUCK}
    for _ in mode.balls:
        for c, closed in enumerate(mode.closed):
            pair = {int(chain.behind[c]), int(chain.ahead[c])}
            if closed and pair & held:
                held |= pair
    return held


def independent(mode: Mode, chain: Chain) -> bool:
    """Return whether no closed contact is implied by the others and by stuck balls."""
    root = list(range(len(mode.balls) + 1))
    ground = len(mode.balls)

    def find(i: int) -> int:
        while root[i] != i:
            i = root[i]
        return i

    links = [(i, ground) for i, state in enumerate(mode.balls) if state == STUCK]
    links += [(int(chain.behind[c]), int(chain.ahead[c])) for c in np.flatnonzero(mode.closed)]
    for one, other in links:
        if find(one) == find(other):
            return False
        root[find(one)] = find(other)
    return True


def candidates(plant: Plant, chain: Chain, q: Array, rates: Array) -> Iterator[Mode]:
    """Yield the modes that the velocities allow, those with most constraints first."""
    choices: list[tuple[int, ...]] = []
    for coefficient, slide in zip(plant.coefficients, plant.theta(rates), strict=True):
        if coefficient == 0.0:
            choices.append((FREE,))
        elif abs(slide) > 2.0 * RATE_SLACK:
            choices.append((FORWARD if slide > 0.0 else BACKWARD, FREE))
        else:
            choices.append((STUCK, FORWARD, BACKWARD, FREE))
    contacts = [(True, False) if touch else (False,) for touch in touching(chain, q, rates)]
    for balls in product(*choices):
        for closed in product(*contacts):
            mode = Mode(balls, closed, motors.Regime())
            if independent(mode, chain):
                yield mode


def agrees(plant: Plant, chain: Chain, mode: Mode, forces: Forces, q: Array, rates: Array) -> bool:
    """Return whether forces and accelerations meet the conditions of the mode."""
    slide = plant.theta(rates)
    gain = plant.theta(forces.accelerations)
    slack = 0.5 * FORCE_SLACK
    fixed = pinned(mode, chain)
    for i, coefficient in enumerate(plant.coefficients):
        state, normal = mode.balls[i], forces.normal[i]
        if coefficient == 0.0:
            continue
        if state == FREE and normal > slack:
            return False
        if state in (FORWARD, BACKWARD):
            starts = abs(slide[i]) > 2.0 * RATE_SLACK or i in fixed or state * gain[i] > 0.0
            if normal < -slack or not starts:
                return False
        if state == STUCK and abs(forces.friction[i]) > coefficient * max(normal, 0.0) + slack:
            return False
    opening = chain.directions(q) @ forces.accelerations + chain.bias(q, rates)
    for c, touch in enumerate(touching(chain, q, rates)):
        if mode.closed[c] and forces.contact[c] < -slack:
            return False
        if touch and not mode.closed[c] and opening[c] < -ACCELERATION_SLACK:
            return False
    return True


def choose_mode(
    plant: Plant, chain: Chain, asked: motors.Command, q: Array, rates: Array, z: float
) -> Mode:
    """Return the mode just after an instant."""
    speed = float(rates[plant.psi])
    # The torque does not jump between regimes that meet, so a provisional one serves to find w'.
    regime = motors.Regime()
    if plant.p.motor is not None:
        raw = motors.raw_torque(plant.p.motor, asked, speed, z)
        if abs(raw) > plant.p.motor.limit:
            regime = motors.Regime(motors.SATURATED, 1 if raw > 0.0 else -1)
    for candidate in candidates(plant, chain, q, rates):
        mode = candidate._replace(regime=regime)
        forces = solve(plant, chain, mode, asked, q, rates, z)
        if agrees(plant, chain, mode, forces, q, rates):
            if plant.p.motor is not None:
                gain = float(forces.accelerations[plant.psi])
                mode = mode._replace(regime=motors.choose(plant.p.motor, asked, speed, gain, z))
            return mode
    raise RuntimeError("no mode agrees with the state")


def guards(
    plant: Plant,
    chain: Chain,
    mode: Mode,
    asked: motors.Command,
    forces: Forces,
    q: Array,
    rates: Array,
    z: float,
) -> list[Guard]:
    """Return the guards of all events that can end the mode."""
    found: list[Guard] = []
    slide = plant.theta(rates)
    fixed = pinned(mode, chain)
    for i, coefficient in enumerate(plant.coefficients):
        state, normal = mode.balls[i], float(forces.normal[i])
        if coefficient == 0.0:
            continue
        if state == STUCK:
            spare = coefficient * max(normal, 0.0) - abs(forces.friction[i])
            found.append(Guard("release", i, float(spare) + FORCE_SLACK))
        elif state == FREE:
            found.append(Guard("load", i, FORCE_SLACK - normal))
        else:
            found.append(Guard("unload", i, normal + FORCE_SLACK))
            if i not in fixed:
                found.append(Guard("stop", i, state * float(slide[i]) + RATE_SLACK))
    gaps = chain.gaps(plant.theta(q))
    for c in range(chain.size):
        if mode.closed[c]:
            found.append(Guard("part", c, float(forces.contact[c]) + FORCE_SLACK))
        else:
            found.append(Guard("impact", c, float(gaps[c]) + GAP_SLACK))
    if plant.p.motor is not None and (plant.p.motor.kp or plant.p.motor.ki):
        speed, gain = float(rates[plant.psi]), float(forces.accelerations[plant.psi])
        values = motors.guards(plant.p.motor, mode.regime, asked, speed, gain, z)
        found += [Guard("motor", i, value) for i, value in enumerate(values)]
    return found


def settled(plant: Plant, chain: Chain, mode: Mode, q: Array, rates: Array) -> tuple[Array, Array]:
    """Return q and q' with the constraints of the mode met exactly: stuck balls, closed gaps."""
    q, rates, first = q.copy(), rates.copy(), plant.psi + 1
    speed = rates[plant.psi]
    for i, coefficient in enumerate(plant.coefficients):
        if coefficient and abs(rates[first + i] - speed) <= 2.0 * RATE_SLACK:
            rates[first + i] = speed
    closes = np.abs(chain.gaps(plant.theta(q))) <= 3.0 * GAP_SLACK
    for c in np.flatnonzero(closes | np.array(mode.closed, bool)):
        pair = first + np.array([chain.behind[c], chain.ahead[c]])
        half = 0.5 * chain.directions(q)[c, pair]
        q[pair] -= chain.gaps(plant.theta(q))[c] * half / (2.0 * half @ half)
        if mode.closed[c]:
            slide = np.abs(half) @ (rates[pair] - speed)
            rates[pair] = speed + 0.5 * slide / np.abs(half)
    return q, rates

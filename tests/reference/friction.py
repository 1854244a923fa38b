"""The set-valued laws: which modes agree with a state, and what ends them.

Coulomb's law, contacts and the motor's limits are each a choice of mode with conditions. A mode
that meets all of them at an instant is the motion just after it. Guards stay positive while the
mode lasts; they change sign a slack beyond the condition, so a mode that has ended cannot be
chosen again at the same instant.
"""

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from . import motor as motors
from .contact import Chain, touching
from .dynamics import BACKWARD, FORWARD, FREE, STUCK, Forces, Mode, solve
from .model import Array, Model

FORCE_SLACK = 1e-13
"""N."""
RATE_SLACK = 1e-11
"""rad/s."""
GAP_SLACK = 1e-12
"""rad."""
ACCELERATION_SLACK = 1e-9
"""rad/s^2, of a gap that opens."""


class Guard(NamedTuple):
    """A number that is positive as long as the mode lasts, and what its end is called."""

    kind: str
    which: int
    value: float


def pinned(mode: Mode, chain: Chain) -> set[int]:
    """Balls that cannot move: stuck ones, and all that closed contacts tie to them."""
    held = {i for i, state in enumerate(mode.balls) if state == STUCK}
    for _ in mode.balls:
        for c, closed in enumerate(mode.closed):
            pair = {int(chain.behind[c]), int(chain.ahead[c])}
            if closed and pair & held:
                held |= pair
    return held


def independent(mode: Mode, chain: Chain) -> bool:
    """Whether no closed contact repeats what the others and stuck balls already say."""
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


def candidates(model: Model, chain: Chain, q: Array, rates: Array) -> Iterator[Mode]:
    """Modes that the velocities allow, the most firmly held first."""
    choices: list[tuple[int, ...]] = []
    for coefficient, slide in zip(model.coefficients, rates[3:] - rates[2], strict=True):
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


def agrees(model: Model, chain: Chain, mode: Mode, forces: Forces, q: Array, rates: Array) -> bool:
    """Whether forces and accelerations are those that the mode takes for granted."""
    slide = rates[3:] - rates[2]
    gain = forces.accelerations[3:] - forces.accelerations[2]
    slack = 0.5 * FORCE_SLACK
    fixed = pinned(mode, chain)
    for i, coefficient in enumerate(model.coefficients):
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
    model: Model, chain: Chain, asked: motors.Command, q: Array, rates: Array, z: float
) -> Mode:
    """The mode just after an instant."""
    speed = float(rates[2])
    # The torque does not jump between regimes that meet, so a provisional one serves to find w'.
    regime = motors.Regime()
    if model.p.motor is not None:
        raw = motors.raw_torque(model.p.motor, asked, speed, z)
        if abs(raw) > model.p.motor.limit:
            regime = motors.Regime(motors.SATURATED, 1 if raw > 0.0 else -1)
    for candidate in candidates(model, chain, q, rates):
        mode = candidate._replace(regime=regime)
        forces = solve(model, chain, mode, asked, q, rates, z)
        if agrees(model, chain, mode, forces, q, rates):
            if model.p.motor is not None:
                gain = float(forces.accelerations[2])
                mode = mode._replace(regime=motors.choose(model.p.motor, asked, speed, gain, z))
            return mode
    raise RuntimeError("no mode agrees with the state")


def guards(
    model: Model,
    chain: Chain,
    mode: Mode,
    asked: motors.Command,
    forces: Forces,
    q: Array,
    rates: Array,
    z: float,
) -> list[Guard]:
    """Everything that can end the mode."""
    found: list[Guard] = []
    slide = rates[3:] - rates[2]
    fixed = pinned(mode, chain)
    for i, coefficient in enumerate(model.coefficients):
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
    gaps = chain.gaps(q[3:] - q[2])
    for c in range(chain.size):
        if mode.closed[c]:
            found.append(Guard("part", c, float(forces.contact[c]) + FORCE_SLACK))
        else:
            found.append(Guard("impact", c, float(gaps[c]) + GAP_SLACK))
    if model.p.motor is not None and (model.p.motor.kp or model.p.motor.ki):
        speed, gain = float(rates[2]), float(forces.accelerations[2])
        values = motors.guards(model.p.motor, mode.regime, asked, speed, gain, z)
        found += [Guard("motor", i, value) for i, value in enumerate(values)]
    return found


def settled(model: Model, chain: Chain, mode: Mode, q: Array, rates: Array) -> tuple[Array, Array]:
    """q and q' with what the mode holds held exactly: rates of stuck balls, closed gaps."""
    q, rates = q.copy(), rates.copy()
    for i, coefficient in enumerate(model.coefficients):
        if coefficient and abs(rates[3 + i] - rates[2]) <= 2.0 * RATE_SLACK:
            rates[3 + i] = rates[2]
    closes = np.abs(chain.gaps(q[3:] - q[2])) <= 3.0 * GAP_SLACK
    for c in np.flatnonzero(closes | np.array(mode.closed, bool)):
        pair = np.array([3 + chain.behind[c], 3 + chain.ahead[c]])
        half = 0.5 * chain.directions(q)[c, pair]
        q[pair] -= chain.gaps(q[3:] - q[2])[c] * half / (2.0 * half @ half)
        if mode.closed[c]:
            speed = np.abs(half) @ (rates[pair] - rates[2])
            rates[pair] = rates[2] + 0.5 * speed / np.abs(half)
    return q, rates

"""Numerical search for resting states of scenes with effects that have no closed form.

The search applies Newton's method to the running kernel, with its exact Jacobian. It starts from
the closed forms of the scene without those effects, and from random states. The search gives no
proof that all states were found.
"""

import math
from collections import Counter
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.equilibria.balanced import positions
from ab_sim.analysis.equilibria.patterns import patterns_of, phase, radii
from ab_sim.analysis.equilibria.resting import (
    ClosedFormRotor,
    base_rotor_of,
    field_at,
    kinds_of,
    state_of,
)
from ab_sim.analysis.equilibria.states import RestingState, resting_state
from ab_sim.analysis.held_speed import state_scale
from ab_sim.base.presentation import in_one_turn
from ab_sim.model.dynamics.system import MASS, RACE_RADIUS, System

_IN_LINE = 0.2
"""Sine of the angle up to which a ball counts as in line with the displacement.

A race off the shaft's axis shifts balls from this line; balls in balance may be anywhere.
"""
STARTS = 40
"""Number of random starts, to be multiplied by the number of balls plus one."""
CLOSE = 1e-12
"""Scaled residual at which Newton's method has converged.

The residual is scaled by the states' magnitudes, so that a single term of the equations is of order
1.
"""
_SINGULAR = 1e-12
"""Threshold of singular values of the scaled Jacobian, relative to the largest.

Smaller singular values belong to a continuum of states.
"""
WORST, BEST = ", worst", ", best"
"""Suffixes of labels for the worst and best position of a continuum."""
_SAME = 1e-6
"""Scaled distance below which two states are equal."""


class Scales(NamedTuple):
    """Magnitudes of the states and of their rates of change, by which residuals are scaled."""

    state: np.ndarray
    """Magnitude of each state, shape (states,)."""
    rate: float
    """Magnitude of the rates of change [1/s]: a scaled state changes by about 1 in 1 / ``rate``."""

    @property
    def length(self) -> float:
        """Magnitude of the displacement [m]."""
        return float(self.state[0])


def scales_of(system: System, speed: float) -> Scales:
    """Return the scales of a system at a speed [rad/s].

    The length is the unbalance of rotor and balls over the total mass, the rate is the speed.
    """
    moments = system.balls[:, MASS] * system.balls[:, RACE_RADIUS]
    length = (system.deck_model.unbalance + float(moments.sum())) / system.deck_model.total_mass
    rate = max(abs(speed), 1e-6)
    return Scales(state_scale(system, max(length, 1e-9), rate), rate)


def converged(system: System, speed: float, state: np.ndarray) -> np.ndarray | None:
    """Return the resting state near a given state by Newton's method; None if it fails.

    On a continuum, the nearest state is returned.

    Parameters
    ----------
    system
        Result of ``resting_system``.
    speed
        Spindle speed w [rad/s].
    state
        First guess, shape (states,).
    """
    field, scales = field_at(system, speed), scales_of(system, speed)
    for _ in range(60):
        residual = field.slope(0.0, state) / (scales.state * scales.rate)
        jacobian = scaled_jacobian(field.jacobian(0.0, state), scales)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return None
        # Singular values of a continuum are cut off, so that the step has no component along it.
        step = np.linalg.lstsq(jacobian, residual, rcond=0.1 * _SINGULAR)[0]
        largest = float(np.abs(step).max())
        size = 1.0 + float(np.abs(state / scales.state)[:4].max())
        # A small residual alone does not suffice: near a fold it is small far from the root.
        if np.abs(residual).max() <= CLOSE * size and largest <= 1e-9 * size:
            return state - step * scales.state
        # Limit the step to half a radian. The deck's part is scaled by the same factor.
        turn = float(np.abs(step[4:]).max()) if len(step) > 4 else 0.0
        state = state - step * scales.state * min(1.0, 0.5 / max(turn, 1e-300))
    return None


def scaled_jacobian(jacobian: np.ndarray, scales: Scales) -> np.ndarray:
    """Return the derivatives of the scaled rates by the scaled states, shape (states, states).

    Parameters
    ----------
    jacobian
        Derivatives of the rates by the states, same shape.
    scales
        Scales of states and rates.
    """
    return jacobian * scales.state / (scales.state[:, None] * scales.rate)


def found_states(system: System, speed: float) -> list[RestingState]:
    """Return the resting states that a search from many starts finds at a nonzero speed [rad/s].

    They are sorted by label, then by falling W; balanced states come last.
    """
    kept: list[np.ndarray] = []
    for start in _starts(system, speed):
        state = converged(system, speed, start)
        if state is not None and not any(same(system, speed, state, x) for x in kept):
            kept.append(state)
    return labelled(system, speed, kept)


def labelled(system: System, speed: float, states: list[np.ndarray]) -> list[RestingState]:
    """Return states labelled by their patterns, with eigenvalues.

    States of one continuum are represented by the first, the worst and the best.

    Parameters
    ----------
    system
        Result of ``resting_system``.
    speed
        Spindle speed w [rad/s].
    states
        Resting states, shape (states,) each.
    """
    by_label: dict[str, list[RestingState]] = {}
    kinds, n = kinds_of(system), len(system.balls)
    for state in states:
        u, theta = state[:2], in_one_turn(state[4 : 4 + n])
        lost = nullity(system, speed, state)
        label = _label(system, speed, u, theta, lost)
        u = np.zeros(2) if label == "balanced" else u
        ways = None if lost else _assignments(theta, kinds)
        by_label.setdefault(label, []).append(
            resting_state(system, speed, label, u, theta, lost, ways)
        )
    named = []
    for label, alike in by_label.items():
        if alike[0].structural_zeros:
            by_growth = sorted(alike, key=lambda state: state.lambda_max)
            named.append(alike[0])
            if len(alike) > 1:
                named.append(by_growth[-1].relabelled(label + WORST))
                named.append(by_growth[0].relabelled(label + BEST))
            continue
        if label == "balanced":
            # Mirror images, unless they differ only by an exchange of equal balls.
            ways = sum(state.assignments or 0 for state in alike)
            named.append(replace(alike[0], assignments=ways))
            continue
        alike.sort(key=lambda state: -state.W)
        for k, one in enumerate(alike):
            named.append(one.relabelled(label + (f"/{k + 1}" if len(alike) > 1 else "")))
    return sorted(named, key=lambda state: (state.label.startswith("balanced"), state.label))


def nullity(system: System, speed: float, state: np.ndarray) -> int:
    """Return the dimension of the continuum of resting states around a state; 0 if isolated."""
    field, scales = field_at(system, speed), scales_of(system, speed)
    sizes = np.linalg.svd(scaled_jacobian(field.jacobian(0.0, state), scales), compute_uv=False)
    return int((sizes < _SINGULAR * sizes[0]).sum())


def _label(system: System, speed: float, u: np.ndarray, theta: np.ndarray, lost: int) -> str:
    """Return the label of a state with displacement u [m], ball angles [rad] and a nullity."""
    W = float(np.hypot(*u))
    if W <= _SAME * scales_of(system, speed).length:
        return "balanced"
    if lost:
        return "continuum"
    phi = math.atan2(u[1], u[0])
    if (np.abs(np.sin(theta - phi)) > _IN_LINE).any():
        return "spread"
    sides = np.cos(theta - phi) > 0.0
    if len({*kinds_of(system)}) <= 1:
        return f"{int(sides.sum())}+{int((~sides).sum())}" if len(theta) else "no balls"
    return "".join("-+"[int(side)] for side in sides)


def _assignments(theta: np.ndarray, kinds: tuple[int, ...]) -> int:
    """Return the number of different states that exchanges of equal balls give."""
    places = [(kind, round(float(np.cos(x)), 6), round(float(np.sin(x)), 6))
              for kind, x in zip(kinds, theta, strict=True)]  # fmt: skip
    shared = math.prod(math.factorial(k) for k in Counter(places).values())
    return math.prod(math.factorial(k) for k in Counter(kinds).values()) // shared


def same(system: System, speed: float, one: np.ndarray, two: np.ndarray) -> bool:
    """Return whether two states are equal within ``_SAME``, up to exchanges of equal balls."""
    scales, n = scales_of(system, speed), len(system.balls)
    far = np.abs(one[:2] - two[:2]).max()
    if far > _SAME * (scales.length + np.abs(one[:2]).max()):
        return False
    kinds = np.array(kinds_of(system))
    for kind in {*kinds.tolist()}:
        remaining = list(np.exp(1j * two[4 : 4 + n][kinds == kind]))
        for place in np.exp(1j * one[4 : 4 + n][kinds == kind]):
            near = int(np.argmin(np.abs(np.array(remaining) - place)))
            if abs(remaining.pop(near) - place) > _SAME:
                return False
    return True


def _starts(system: System, speed: float) -> list[np.ndarray]:
    """Return first guesses: the closed forms without other effects, then random states."""
    rotor: ClosedFormRotor = base_rotor_of(system)
    n = len(system.balls)
    starts = [state_of(system, speed, np.zeros(2), theta) for theta in positions(rotor)]
    for pattern in patterns_of(rotor):
        for W in radii(rotor, pattern.moment, speed):
            phi = phase(rotor, pattern.moment, speed, W)
            u = W * np.array([math.cos(phi), math.sin(phi)])
            theta = np.array([phi if sign > 0 else phi + math.pi for sign in pattern.signs])
            starts.append(state_of(system, speed, u, theta))
    draw = np.random.default_rng(0)
    length = scales_of(system, speed).length
    # The whirl near resonance is much larger than ``length``: draw from 0.1 to 30 times that.
    for _ in range(STARTS * (n + 1)):
        u = length * 10.0 ** draw.uniform(-1.0, 1.5) * draw.normal(size=2)
        starts.append(state_of(system, speed, u, draw.uniform(-math.pi, math.pi, n)))
    return starts

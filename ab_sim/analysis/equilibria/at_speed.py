"""All resting states of a scene at one speed."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.equilibria.balanced import known_positions, positions_at
from ab_sim.analysis.equilibria.finder import BEST, WORST, found_states
from ab_sim.analysis.equilibria.patterns import Pattern, patterns_of, phase, radii
from ab_sim.analysis.equilibria.resting import LEFT_OUT, ClosedFormRotor, resting_system, rotor_of
from ab_sim.analysis.equilibria.states import RestingState, resting_state
from ab_sim.base.presentation import Column, Columns, Presented, number
from ab_sim.model.dynamics.system import System
from ab_sim.scene.model import Scene


@dataclass(frozen=True, repr=False)
class Equilibria(Presented):
    """Resting states of deck and balls at one speed, with stability; see ``ab_sim.equilibria``."""

    _picture = "equilibria"

    scene: str
    speed: float
    """Spindle speed w [rad/s]."""
    branches: tuple[RestingState, ...]
    """Resting states, one per pattern and radius.

    Assignments of balls to places that only exchange equal balls are not repeated. Patterns with
    several states list the largest W first. The balanced set comes last: for three or more balls
    its symmetric position, the worst and the best.
    """
    left_out: tuple[str, ...]
    """Effects of the scene that are left out because they are set-valued where balls rest."""
    by_numbers: bool = False
    """True if states were searched numerically from many starts, which may miss some.

    False for the closed forms, which give all states.
    """
    balanced_positions: str | None = None
    """Positions among which worst and best were chosen.

    ``balanced.ALL`` or ``balanced.SAMPLED``; None if there is no worst and best position.
    """

    @property
    def stable(self) -> tuple[RestingState, ...]:
        """Resting states to which small disturbances decay."""
        return tuple(state for state in self.branches if state.stable)

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene,
            "speed": number(self.speed, "rad/s"),
            "states": str(len(self.branches)),
            "stable": " and ".join(state.label for state in self.stable) or "none",
        }

    def _columns(self) -> Columns:
        states = self.branches
        return {
            "label": Column(None, [state.label for state in states]),
            "W": Column("m", [state.W for state in states]),
            "lambda_max": Column("1/s", [state.lambda_max for state in states]),
            "verdict": Column(None, [state.verdict for state in states]),
            "ways": Column("1", [state.assignments for state in states]),
            "theta": Column("rad", [tuple(state.theta.tolist()) for state in states]),
        }

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        return {
            "scene": self.scene,
            "speed": self.speed,
            "branches": [state.report() for state in self.branches],
            "left_out": list(self.left_out),
            "by_numbers": self.by_numbers,
            "balanced_positions": self.balanced_positions,
        }


def equilibria_of(scene: Scene, speed: float) -> Equilibria:
    """Return the resting states of a scene at a constant speed [rad/s], with their eigenvalues.

    Friction and contact are left out. States are in closed form unless an effect has none; they are
    then searched for numerically.

    Raises
    ------
    SceneError
        The equations contain the spindle's angle, or its speed is a state; or there are too many
        patterns.
    """
    system = resting_system(scene)
    rotor = rotor_of(system)
    if speed == 0.0:
        n = len(system.balls)  # at rest, balls lie at any angle, here at 0
        states = [resting_state(system, speed, "standing", np.zeros(2), np.zeros(n), n)]
    elif rotor is None:
        states = found_states(system, speed)
    else:
        states = resting_states(system, rotor, speed)
    omitted = tuple(name for name in LEFT_OUT if name in scene.effects)
    has_extremes = any(state.label.endswith(WORST) for state in states)
    positions = known_positions(rotor, len(system.balls)) if has_extremes else None
    return Equilibria(scene.name, speed, tuple(states), omitted, rotor is None, positions)


def resting_states(system: System, rotor: ClosedFormRotor, speed: float) -> list[RestingState]:
    """Return the resting states from closed forms, at a nonzero speed [rad/s].

    If three or more balls can balance, the balanced states are those at the symmetric, the worst
    and the best position.

    Parameters
    ----------
    system
        Result of ``resting_system``.
    rotor
        Closed-form parameters of the system.
    speed
        Spindle speed w [rad/s].
    """
    states = [
        resting_state(system, speed, *place)
        for pattern in patterns_of(rotor)
        for place in clustered_places(rotor, speed, pattern)
    ]
    without = not rotor.moments and not rotor.unbalance
    positions = [np.empty(0)] if without else positions_at(system, rotor, speed)
    balanced = [balanced_state(system, rotor, speed, theta) for theta in positions]
    if len(balanced) > 1:
        by_growth = sorted(balanced, key=lambda state: state.lambda_max)
        worst, best = by_growth[-1], by_growth[0]
        balanced = [
            balanced[0], worst.relabelled(worst.label + WORST), best.relabelled(best.label + BEST)
        ]  # fmt: skip
    return states + balanced


class RestingPlace(NamedTuple):
    """Resting state in closed form, before its eigenvalues are computed; see ``resting_state``."""

    label: str
    u: np.ndarray
    """Displacement of the deck on the rotating axes [m], shape (2,)."""
    theta: np.ndarray
    """Ball angles from the unbalance [rad], shape (n,)."""
    structural_zeros: int
    """Number of eigenvalues that are exactly 0 because the state is part of a continuum."""
    assignments: int | None
    """Number of ways to assign the balls to the places; None in a continuum."""
    balance_alike: bool = False
    """True if n >= 3 equal balls balance: n - 2 of their motions then have the same eigenvalues."""


def clustered_places(rotor: ClosedFormRotor, speed: float, pattern: Pattern) -> list[RestingPlace]:
    """Return the states of a pattern with W > 0, the largest W first."""
    roots = radii(rotor, pattern.moment, speed)
    places = []
    for rank, W in enumerate(roots, start=1):
        label = pattern.label + (f"/{rank}" if len(roots) > 1 else "")
        phi = phase(rotor, pattern.moment, speed, W)
        u = np.array([W * math.cos(phi), W * math.sin(phi)])
        opposite = phi - math.copysign(math.pi, phi)
        theta = np.array([phi if sign > 0 else opposite for sign in pattern.signs])
        places.append(RestingPlace(label, u, theta, _turning(rotor), pattern.assignments))
    return places


def balanced_place(rotor: ClosedFormRotor, theta: np.ndarray) -> RestingPlace:
    """Return the state with W = 0 at balanced ball angles theta [rad], shape (n,)."""
    n = len(theta)
    zeros = max(0, n - 2, _turning(rotor))
    ways = {1: 1, 2: 2 if (np.abs(np.sin(theta)) > 1e-9).any() else 1}.get(n)
    alike = n > 2 and len({*rotor.kinds}) == 1
    return RestingPlace("balanced", np.zeros(2), theta, zeros, ways, alike)


def balanced_state(
    system: System, rotor: ClosedFormRotor, speed: float, theta: np.ndarray
) -> RestingState:
    """Return the state of ``balanced_place`` with its eigenvalues at a speed [rad/s]."""
    return resting_state(system, speed, *balanced_place(rotor, theta))


def _turning(rotor: ClosedFormRotor) -> int:
    """Return 1 if all balls can be shifted by one angle, 0 if an unbalance fixes their angles."""
    return int(rotor.unbalance == 0.0 and len(rotor.moments) > 0)

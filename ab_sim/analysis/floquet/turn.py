"""Map of the state over one spindle revolution, and its fixed points: periodic solutions.

At a constant speed w the equations are periodic with T = 2 pi / w. The map of a turn is P(y). A
solution of y = P(y) is periodic, and M = dP/dy is its monodromy matrix (Floquet). P consists of
Runge-Kutta steps, and M is their exact derivative (``integrate.vector_field``).

Fixed points are found by Newton's method (shooting). The unknowns are 2 (K + n) independent
coordinates for K unknowns of the deck and n balls. A quaternion's length is not a coordinate (the
deck model's ``tangent``). Angles of balls count modulo one revolution. A ball that lags by one
revolution per turn of the spindle, hanging in space, is thus periodic too.

Source: Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 3.2 (Floquet), 6.5 (shooting).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.optimize import least_squares

from ab_sim.analysis.held_speed import FASTEST, SLOWEST, held, state_scale
from ab_sim.base.errors import InputError, SceneError, exact
from ab_sim.engine.integrate.choose import largest_step
from ab_sim.engine.integrate.registry import stepper_named
from ab_sim.engine.integrate.vector_field import Flow, Flown
from ab_sim.engine.stepping.fixed_step import normalise
from ab_sim.model.dynamics.assemble import linear_rates, start_state
from ab_sim.model.dynamics.registry import require_built_in
from ab_sim.model.dynamics.system import HEIGHT, MASS, RACE_RADIUS, has_contact, has_friction
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Start

METHOD = "rk8"
_FEWEST, MOST = 48, 1 << 16
"""Least and largest number of steps in a turn; the largest takes about a minute."""
SAFETY = 2.5
"""Ratio of the largest stable step to the step used, so that fast decay is accurate."""
CLOSED = 1e-9
"""Largest gap of a periodic solution in units of ``TurnMap.scale``.

Newton's last step usually reaches rounding.
"""
_ROUNDED = 1e-14
"""Gap of a periodic solution at which Newton's method stops, in units of ``TurnMap.scale``."""
_NEWTON = 60
"""Largest number of Newton iterations."""
FARTHEST = 0.5
"""Largest change of a ball angle in a Newton step [rad]."""
FLAT = 1e-10
"""Relative threshold of singular values: smaller ones belong to manifolds of solutions."""

Guess = TypeVar("Guess")
Candidate = TypeVar("Candidate")


def newton(
    trial: Callable[[Guess, int], tuple[Candidate, float, Callable[[], Guess | None]]], guess: Guess
) -> Candidate | None:
    """Return the solution that Newton's method reaches from a guess; None if it does not converge.

    Parameters
    ----------
    trial
        Function of a guess and the number of the iteration. It returns the candidate at the guess,
        its scaled residual, and a function for the next guess (None if not finite).
    guess
        First guess.
    """
    best, smallest = None, math.inf
    for iteration in range(_NEWTON):
        candidate, residual, following = trial(guess, iteration)
        if not math.isfinite(residual):
            return None
        # Convergence is quadratic down to rounding, which depends on the scene and has no usable
        # bound. A residual that no longer halves has reached it.
        if smallest < CLOSED and residual >= 0.5 * smallest:
            return best
        best, smallest = candidate, residual
        if residual <= _ROUNDED:
            return best
        next_guess = following()
        if next_guess is None:
            return None
        guess = next_guess
    return best if smallest < CLOSED else None


class Orbit(NamedTuple):
    """Periodic solution."""

    states: np.ndarray
    """States at the start and after each step of a turn, shape (steps + 1, states)."""
    monodromy: np.ndarray
    """Monodromy matrix M in independent coordinates, shape (2 (K + n), 2 (K + n))."""
    residual: float
    """Largest entry of the gap after a turn, in units of the scale."""
    iterations: int
    """Number of Newton iterations."""

    @property
    def start(self) -> np.ndarray:
        """State at the start, shape (states,)."""
        start: np.ndarray = self.states[0]
        return start

    @property
    def steps(self) -> int:
        """Number of steps in a turn."""
        return len(self.states) - 1


class TurnMap:
    """Map P of the state over one spindle revolution, at a constant speed.

    Parameters
    ----------
    scene
        Scene; its profile is ignored.
    speed
        Spindle speed w [rad/s].

    Raises
    ------
    InputError
        The spindle stands still, or exceeds the limit of scenes.
    SceneError
        The scene has events, a spindle speed that is a state, a decay too fast for the largest
        number of steps, or a deck model that is not built in.
    """

    def __init__(self, scene: Scene, speed: float) -> None:
        if not SLOWEST <= abs(speed) <= FASTEST:
            raise InputError(
                f"speed = {exact(speed)} rad/s: must be from 1e-6 to {FASTEST:g} in size, forwards "
                "or backwards, because solutions repeat with every turn of the spindle"
            )
        require_built_in(scene, "Floquet analysis")
        self.scene, self.speed = scene, speed
        field = held(scene, speed, scene.start.angle)
        self.system, self.layout = field.system, field.layout
        _check_smooth(scene, self.system.effects)
        stepper = stepper_named(METHOD)
        self.period = 2.0 * math.pi / abs(speed)
        most, what = largest_step(stepper, linear_rates(self.system, abs(speed)))
        self.fewest = max(_FEWEST, math.ceil(SAFETY * self.period / most))
        """Least number of steps in a turn."""
        if 2 * self.fewest > MOST:
            raise SceneError(
                f"a turn at {exact(speed)} rad/s takes {self.period:.3g} s, and {what} is so fast "
                f"that the turn needs {self.fewest} steps; at most {MOST // 2} are allowed, as a "
                "check doubles them: lower that rate, or raise the speed"
            )
        self._flow = Flow(self.system, field.scheduled, field.discrete_state, stepper)
        self.scale = state_scale(self.system, scene.whirl_unit[0], speed)
        """Magnitudes of the states, shape (states,)."""

    def scene_start(self) -> np.ndarray:
        """Return the initial state of the scene."""
        return start_state(self.scene, self.system)

    def rest(self) -> np.ndarray:
        """Return the deck's part of the state with the deck at its rest position."""
        scene = self.scene.model_copy(update={"start": Start()})
        rest: np.ndarray = start_state(scene, self.system)[self.layout.deck]
        return rest

    def integrate(
        self, state: np.ndarray, duration: float, steps: int, columns: int | None = None
    ) -> Flown:
        """Integrate a state over any duration [s], see ``Flow.over``."""
        return self._flow.over(state, duration, steps, columns)

    def after_turn(self, state: np.ndarray, steps: int) -> np.ndarray:
        """Return P(y) with angles reduced to one revolution, shape (states,)."""
        end = self._flow.over(state, self.period, steps, columns=0).states[-1]
        end[self.layout.angles] = within_turn(end[self.layout.angles])
        self._normalise(end)
        return end

    def basis(self, state: np.ndarray) -> np.ndarray:
        """Return the directions of the independent coordinates at a state, one per column.

        Returns
        -------
        np.ndarray
            Array with shape (states, 2 (K + n)). It differs from the identity only if the deck's
            state contains a quaternion.
        """
        deck_states = self.layout.deck.stop
        tangent = self.system.deck_model.tangent(state[:deck_states])
        balls = self.layout.size - deck_states
        directions = np.zeros((deck_states + balls, tangent.shape[1] + balls))
        directions[:deck_states, : tangent.shape[1]] = tangent
        directions[deck_states:, tangent.shape[1] :] = np.eye(balls)
        return directions

    def shoot(self, guess: np.ndarray, steps: int | None = None) -> Orbit | None:
        """Return the periodic solution near a guess; None if Newton's method does not converge.

        Parameters
        ----------
        guess
            State at the start of a turn.
        steps
            Number of steps in a turn; default ``fewest``.
        """
        number, state = steps or self.fewest, guess.copy()
        state[self.layout.angles] = within_turn(state[self.layout.angles])

        def trial(
            state: np.ndarray, iteration: int
        ) -> tuple[Orbit, float, Callable[[], np.ndarray | None]]:
            orbit, gap, scale = self._orbit(state, number, iteration)
            return orbit, orbit.residual, lambda: self._step(state, orbit, gap, scale)

        return newton(trial, state)

    def _orbit(
        self, state: np.ndarray, steps: int, iteration: int
    ) -> tuple[Orbit, np.ndarray, np.ndarray]:
        """Integrate one turn; return the orbit, the gap P(y) - y, and the scale of its entries."""
        flown = self._flow.over(state, self.period, steps)
        basis, end = self.basis(state), flown.states[-1]
        gap = end - state
        gap[self.layout.angles] = within_turn(gap[self.layout.angles])
        gap, scale = basis.T @ gap, (basis**2).T @ self.scale
        if not np.isfinite(flown.matrix).all():
            return Orbit(flown.states, flown.matrix, math.inf, iteration), gap, scale
        monodromy = self.basis(end).T @ flown.matrix @ basis
        residual = float(np.abs(gap / scale).max(initial=0.0))
        return Orbit(flown.states, monodromy, residual, iteration), gap, scale

    def _step(
        self, state: np.ndarray, orbit: Orbit, gap: np.ndarray, scale: np.ndarray
    ) -> np.ndarray | None:
        """Return the state after a Newton step from ``_orbit``; None if it is not finite."""
        # Least squares of minimal norm: along a manifold of solutions the matrix is singular, and
        # the nearest solution is taken.
        matrix = (orbit.monodromy - np.eye(len(gap))) * scale / scale[:, None]
        change = scale * np.linalg.lstsq(matrix, -gap / scale, rcond=FLAT)[0]
        farthest = np.abs(self.basis(state) @ change)[self.layout.angles].max(initial=0.0)
        if not math.isfinite(farthest):
            return None
        # Far from a solution a full step can turn balls by many revolutions, into the basin of
        # another solution: shorten it.
        return self._moved(state, change * min(1.0, FARTHEST / max(farthest, 1e-300)))

    def _moved(self, state: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return a state moved by a change of its independent coordinates."""
        state = state + self.basis(state) @ change
        state[self.layout.angles] = within_turn(state[self.layout.angles])
        self._normalise(state)
        return state

    def _normalise(self, state: np.ndarray) -> None:
        """Normalise the deck's quaternion in a state, if there is one."""
        first = type(self.system.deck_model).UNIT_AT
        if first >= 0:
            normalise(state, first)


def within_turn(angles: np.ndarray) -> np.ndarray:
    """Return angles reduced to -pi to pi [rad]; angles in this range are unchanged."""
    return angles - 2.0 * math.pi * np.round(angles / (2.0 * math.pi))


def _check_smooth(scene: Scene, effects: tuple[object, ...]) -> None:
    """Refuse scenes with friction or contact, whose motion is not smooth.

    Raises
    ------
    SceneError
        There are such effects; the message names those to remove.
    """
    if not (has_friction(effects) or has_contact(effects)):
        return
    named = [
        name
        for name, effect in scene.effects.items()
        if hasattr(effect, "friction_coefficient") or hasattr(effect, "restitution")
    ]
    out = " ".join(f"--set effects.{name}=" for name in named)
    raise SceneError(
        f"effects.{named[0]}: causes events, at which the motion has jumps and kinks; the monodromy"
        " matrix would need saltation matrices, which are not implemented; remove effects with "
        f"events: {out}"
    )


TURNS = 500
"""Largest number of spindle revolutions for settling."""


def _from_balance(turn: TurnMap) -> np.ndarray:
    """Return the state of a deck at rest with balls at ``balanced_angles``, shape (states,)."""
    state = np.zeros(turn.layout.size)
    state[turn.layout.deck] = turn.rest()
    state[turn.layout.angles] = balanced_angles(turn)
    return state


def _from_settling(turn: TurnMap) -> np.ndarray:
    """Return the state after up to ``TURNS`` revolutions at constant speed from the scene's start.

    Raises
    ------
    FloatingPointError
        The motion grows without bound.
    """
    state = turn.scene_start()
    for _ in range(TURNS):
        before, state = state, turn.after_turn(state, turn.fewest)
        if not np.isfinite(state).all():
            raise FloatingPointError("the motion grows beyond all bounds")
        if (np.abs(state - before) <= 1e-9 * turn.scale).all():
            break
    return state


STARTS: Mapping[str, Callable[[TurnMap], np.ndarray]] = {
    "start": TurnMap.scene_start,
    "balanced": _from_balance,
    "settled": _from_settling,
}
"""Starting states by name, in the order in which they are tried."""


def balanced_angles(turn: TurnMap) -> np.ndarray:
    """Return the ball angles that best cancel the rotor's unbalance [rad], shape (n,).

    For a deck in space they also cancel its couple unbalance. Of several such positions, the one
    near evenly spread balls is returned.
    """
    n, balls, scene = len(turn.system.balls), turn.system.balls, turn.scene
    if n == 0:
        return np.zeros(0)
    heavy = balls[:, MASS] * balls[:, RACE_RADIUS]
    levers, rotor = [heavy], [turn.system.deck_model.unbalance + 0.0j]
    if scene.deck is not None:
        levers.append(heavy * balls[:, HEIGHT] / scene.race.radius)
        rotor.append(scene.couple_unbalance / scene.race.radius)

    def residual(angles: np.ndarray) -> np.ndarray:
        sums = np.array(levers) @ np.exp(1j * angles) + np.array(rotor)
        return np.concatenate([sums.real, sums.imag]) / heavy.sum()

    spread = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    fit = least_squares(residual, spread, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return np.asarray(fit.x)


def find_orbit(turn: TurnMap, names: Sequence[str]) -> tuple[Orbit | None, str]:
    """Return the first periodic solution found from named starts, and the name of its start.

    Parameters
    ----------
    turn
        Turn map of the scene.
    names
        Names in ``STARTS``, in the order in which they are tried.

    Returns
    -------
    tuple[Orbit | None, str]
        The solution and its name; None and an empty text if there is none from these starts.
    """
    for name in names:
        try:
            orbit = turn.shoot(STARTS[name](turn))
        except FloatingPointError:
            continue
        if orbit is not None:
            return orbit, name
    return None, ""

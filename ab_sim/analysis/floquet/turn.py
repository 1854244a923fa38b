"""One turn of the spindle as a map of the state, and its fixed points: periodic solutions.

At a held speed w the equations repeat after T = 2 pi / w at the latest. What a turn makes of the
state is P(y); y = P(y) is a periodic solution, and M = dP/dy its monodromy matrix (Floquet). P is
as many steps of a Runge-Kutta method, M their exact derivative (``integrate.flow``).

Fixed points are found by Newton's method (shooting), in the 2 (K + n) genuine coordinates of K
unknowns of the deck and n balls: a quaternion's length is no motion (the deck model's ``tangent``),
and turns of a ball's angle are none either, so that a ball that stays behind by a turn each turn of
the spindle, hanging in space, is periodic too.

Source: Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 3.2 (Floquet), 6.5 (shooting).
"""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.held_speed import FASTEST, held
from ab_sim.dynamics.assemble import linear_rates, start_state
from ab_sim.dynamics.registry import require_built_in
from ab_sim.dynamics.system import has_contact, has_friction
from ab_sim.errors import InputError, SceneError, exact
from ab_sim.integrate.flow import Flow, Flown
from ab_sim.integrate.limits import largest_step
from ab_sim.integrate.registry import stepper_named
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Start
from ab_sim.stepping.fixed_step import normalise

METHOD = "rk8"
FEWEST, MOST = 48, 1 << 16
"""Steps in a turn: of motions that a turn resolves, and what is still done in a minute or so."""
SAFETY = 2.5
"""How many times shorter than the largest stable step, so that fast decay is computed well."""
CLOSED = 1e-9
"""What a start may miss itself by, in the units of ``TurnMap.scale``; Newton's last step gets to
rounding."""
ROUNDED = 1e-14
"""A start that misses itself by no more is not looked for further."""
NEWTON = 60
FARTHEST = 0.5
"""That a ball is moved by a step of Newton's method [rad]."""
FLAT = 1e-10
"""Singular values below this share of the largest are 0: along them solutions form a manifold."""


class Orbit(NamedTuple):
    """A periodic solution."""

    states: np.ndarray
    """At the start and after each step of a turn, shape (steps + 1, states)."""
    monodromy: np.ndarray
    """M in the genuine coordinates, shape (2 (K + n), 2 (K + n))."""
    residual: float
    """What the start misses itself by after a turn: the largest entry, in units of the scale."""
    iterations: int
    """Of Newton's method."""

    @property
    def start(self) -> np.ndarray:
        """The state at the start, shape (states,)."""
        start: np.ndarray = self.states[0]
        return start

    @property
    def steps(self) -> int:
        """In a turn."""
        return len(self.states) - 1


class TurnMap:
    """P of a scene at a speed.

    Args:
        scene: what moves; its profile does not matter.
        speed: w [rad/s].

    Raises:
        InputError: the spindle stands, or is beyond what scenes may ask for.
        SceneError: the scene has events, or a state of the spindle; drag that no step resolves; or
            a deck model that is not a built-in one.
    """

    def __init__(self, scene: Scene, speed: float) -> None:
        if not 1e-6 <= abs(speed) <= FASTEST:
            raise InputError(
                f"speed = {exact(speed)} rad/s: must be within 1e-6 to {FASTEST:g}, or the same "
                "backwards: the solutions looked for repeat with every turn of the spindle"
            )
        require_built_in(scene, "Floquet analysis")
        self.scene, self.speed = scene, speed
        field = held(scene, speed, scene.start.angle)
        self.system, self.layout = field.system, field.layout
        _check_smooth(scene, self.system.effects)
        stepper = stepper_named(METHOD)
        self.period = 2.0 * math.pi / abs(speed)
        most, what = largest_step(stepper, linear_rates(self.system, abs(speed)))
        self.fewest = max(FEWEST, math.ceil(SAFETY * self.period / most))
        """Steps in a turn."""
        if 2 * self.fewest > MOST:
            raise SceneError(
                f"a turn at {exact(speed)} rad/s takes {self.period:.3g} s, and {what} is so fast "
                f"that it would have to be cut into {self.fewest} steps; {MOST // 2} at most are "
                "taken, and half as long ones to check them: lower that rate, or raise the speed"
            )
        self._flow = Flow(self.system, field.scheduled, field.discrete_state, stepper)
        length, _ = scene.whirl_unit
        self.scale = np.ones(self.layout.size)
        """Magnitudes of the states, shape (states,)."""
        self.scale[self.layout.deck] = self.system.deck_model.scale(length, abs(speed))
        self.scale[self.layout.rates] = abs(speed)

    def scene_start(self) -> np.ndarray:
        """The state that the scene starts in."""
        return start_state(self.scene, self.system)

    def rest(self) -> np.ndarray:
        """The deck model's states where the deck hangs at rest."""
        scene = self.scene.model_copy(update={"start": Start()})
        rest: np.ndarray = start_state(scene, self.system)[self.layout.deck]
        return rest

    def over(
        self, state: np.ndarray, duration: float, steps: int, columns: int | None = None
    ) -> Flown:
        """What any stretch of time [s] makes of a state, as ``Flow.over``."""
        return self._flow.over(state, duration, steps, columns)

    def after_turn(self, state: np.ndarray, steps: int) -> np.ndarray:
        """P(y), angles brought back into a turn; shape (states,)."""
        end = self._flow.over(state, self.period, steps, columns=0).states[-1]
        end[self.layout.angles] = within_turn(end[self.layout.angles])
        self._normalise(end)
        return end

    def ways(self, state: np.ndarray) -> np.ndarray:
        """The genuine coordinates' directions at a state, columns, shape (states, 2 (K + n))."""
        own = self.layout.deck.stop
        tangent = self.system.deck_model.tangent(state[:own])
        balls = self.layout.size - own
        found = np.zeros((own + balls, tangent.shape[1] + balls))
        found[:own, : tangent.shape[1]] = tangent
        found[own:, tangent.shape[1] :] = np.eye(balls)
        return found

    def shoot(self, guess: np.ndarray, steps: int | None = None) -> Orbit | None:
        """The periodic solution that Newton's method finds from a guess; None where it finds none.

        Args:
            guess: state at the start of a turn.
            steps: in a turn; default ``fewest``.
        """
        steps, state = steps or self.fewest, guess.copy()
        state[self.layout.angles] = within_turn(state[self.layout.angles])
        best, missed = None, math.inf
        for iteration in range(NEWTON):
            orbit, gap, scale = self._orbit(state, steps, iteration)
            if orbit is None:
                return None
            if missed < CLOSED and orbit.residual >= 0.5 * missed:
                return best
            missed, best = orbit.residual, orbit
            if missed <= ROUNDED:
                return best
            matrix = (orbit.monodromy - np.eye(len(gap))) * scale / scale[:, None]
            change = scale * np.linalg.lstsq(matrix, -gap / scale, rcond=FLAT)[0]
            farthest = np.abs(self.ways(state) @ change)[self.layout.angles].max(initial=0.0)
            if not math.isfinite(farthest):
                return None
            state = self._moved(state, change * min(1.0, FARTHEST / max(farthest, 1e-300)))
        return best if missed < CLOSED else None

    def _orbit(
        self, state: np.ndarray, steps: int, iteration: int
    ) -> tuple[Orbit | None, np.ndarray, np.ndarray]:
        """What a turn makes of a state: the orbit, the gap P(y) - y, and its entries' scale."""
        flown = self._flow.over(state, self.period, steps)
        ways, end = self.ways(state), flown.states[-1]
        gap = end - state
        gap[self.layout.angles] = within_turn(gap[self.layout.angles])
        gap, scale = ways.T @ gap, (ways**2).T @ self.scale
        if not np.isfinite(flown.matrix).all():
            return None, gap, scale
        monodromy = self.ways(end).T @ flown.matrix @ ways
        missed = float(np.abs(gap / scale).max(initial=0.0))
        return Orbit(flown.states, monodromy, missed, iteration), gap, scale

    def _moved(self, state: np.ndarray, change: np.ndarray) -> np.ndarray:
        state = state + self.ways(state) @ change
        state[self.layout.angles] = within_turn(state[self.layout.angles])
        self._normalise(state)
        return state

    def _normalise(self, state: np.ndarray) -> None:
        """Make a quaternion in the state a unit one."""
        first = type(self.system.deck_model).UNIT_AT
        if first >= 0:
            normalise(state, first)


def within_turn(angles: np.ndarray) -> np.ndarray:
    """Angles brought within -pi to pi [rad]; those that are stay as they are."""
    return angles - 2.0 * math.pi * np.round(angles / (2.0 * math.pi))


def _check_smooth(scene: Scene, effects: tuple[object, ...]) -> None:
    """Refuse what has events.

    Raises:
        SceneError: names the effects to take out.
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
        f"effects.{named[0]}: at its events the motion has jumps and kinks, which the monodromy "
        f"matrix would need saltation matrices for, and these are not built; take out what has "
        f"events: {out}"
    )

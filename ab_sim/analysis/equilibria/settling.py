"""The three-ball paper's nonlinear test: disturb each coordinate, integrate, see where it goes.

For what the linear test leaves undecided (three-ball, section 4): a state is stable if the motion
comes back to it from a disturbance along each coordinate, one at a time. As all resting states of
a continuum are as good, coming back to the continuum counts: to the same whirl.
"""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.equilibria.resting import LEFT_OUT, resting_system, state_of
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.drive import Drive
from ab_sim.errors import InputError
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Spindle, Start

SIZE = 0.2
"""Of a disturbance: rad of angles, and shares of the unit of length and of the speed. Not small: an
algebraic decay is slow near its end."""
NEARER = 0.75
"""Share of a disturbance that may be left."""
BACK = 1e-6
"""Scaled, so near to a state that it is back."""
MOST_STEPS = 1e8
"""Of all motions together."""
TURNS = 2000.0
"""Of the spindle, that each motion is given."""


class DisturbanceOutcome(NamedTuple):
    """What became of a disturbance; how far off it was, scaled, is the largest over all states."""

    coordinate: str
    """The sense and the state's name."""
    start: float
    """How far off it began."""
    middle: float
    """How far off it was after half the time."""
    rest: float
    """How far off it was in the end."""

    @property
    def returned(self) -> bool:
        """Whether it came back, or is on its way."""
        nearer = self.rest <= NEARER * self.start and self.rest < self.middle
        return nearer or self.rest <= BACK


class Settling(NamedTuple):
    """The nonlinear test's result."""

    outcomes: tuple[DisturbanceOutcome, ...]

    @property
    def stable(self) -> bool:
        """Whether all disturbances came back."""
        return all(outcome.returned for outcome in self.outcomes)


def settles(
    scene: Scene, speed: float, state: RestingState, size: float = SIZE, turns: float = TURNS
) -> Settling:
    """Disturb each coordinate of a resting state in either sense, and integrate.

    Friction and contact are left out, as they are of the state.

    Args:
        scene: whose state it is.
        speed: w [rad/s], not 0.
        state: of ``equilibria_of``.
        size: of the disturbances: rad, units of length (e), shares of the speed.
        turns: of the spindle that each motion is given.

    Raises:
        SceneError: as ``equilibria_of``.
        InputError: the spindle is so slow that so many turns would take too many steps.
        DivergedError: a motion leaves all bounds.
    """
    system = resting_system(scene)
    n, length = len(system.balls), scene.whirl_unit[0]
    rest = state_of(system, speed, state.u, state.theta)
    deck = [length, length, length * speed, length * speed]
    scale = np.abs(np.array([*deck, *[1.0] * n, *[speed] * n]))
    drive = Drive(_held(scene, speed, state))
    steps = max(1, math.ceil(turns * math.pi / abs(speed) / drive.step))
    in_all = 4 * len(rest) * steps
    if in_all > MOST_STEPS:
        raise InputError(
            f"speed = {speed:g} rad/s: {turns:g} turns from each disturbance would take "
            f"{in_all:.2g} steps; at most {MOST_STEPS:.0e} are taken. Ask at a higher speed, or "
            "for fewer turns"
        )
    begin = drive.snapshot()
    outcomes = []
    for k, name in enumerate(drive.vector_field().layout.names):
        for sign in (1.0, -1.0):
            moved = rest.copy()
            moved[k] += sign * size * scale[k]
            # Nothing that the stepper remembers belongs to the state that it is given.
            drive.restore(begin._replace(state=moved, memory=np.empty(0)))
            offs = []
            for _ in range(2):
                drive.advance(steps, every=steps)
                final = drive.snapshot().state
                offs.append(_off(final, rest, scale, n, state.structural_zeros))
            outcomes.append(DisturbanceOutcome(f"{'+' if sign > 0 else '-'} {name}", size, *offs))
    return Settling(tuple(outcomes))


def _off(final: np.ndarray, rest: np.ndarray, scale: np.ndarray, n: int, zeros: int) -> float:
    """How far a state is from another, scaled; where angles form a continuum, without these."""
    apart = (final - rest) / scale
    apart[4 : 4 + n] = np.angle(np.exp(1j * apart[4 : 4 + n]))
    if zeros:
        apart[4 : 4 + n] = 0.0
    return float(np.abs(apart).max())


def _held(scene: Scene, speed: float, state: RestingState) -> Scene:
    """The scene at a speed that is held, starting at rest on the rotating axes."""
    effects = {name: effect for name, effect in scene.effects.items() if name not in LEFT_OUT}
    start = Start(speed=speed, ball_angles=tuple(state.theta.tolist()))
    limit = max(scene.spindle.max_speed, abs(speed))
    spindle = Spindle(max_speed=limit, max_acceleration=scene.spindle.max_acceleration)
    changes = {
        "effects": effects,
        "start": start,
        "spindle": spindle,
        "profile": None,
        "accuracy": None,
    }
    return scene.model_copy(update=changes)
